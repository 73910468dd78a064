// SPDX-License-Identifier: MIT
// What a client may expect of a session after what it sent, by docs/PROTOCOL.md: told every frame in both directions,
// it aborts at the first that breaks a rule. It has no socket, and never looks into the daemon.
//
// The order in which it is told matters: a frame of the data channel only after all frames of the request channel that
// were sent before it (the two channels overtake each other, S-2).
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "daemon/net/limits.h"
#include "proto/messages.h"
#include "proto/session.h"
#include "tests/fuzz/memory_source.h"

namespace pmcd::fuzz {

class ClientModel {
 public:
  /// REQUIRES: both outlive the model.
  ClientModel(const MemorySource& source, const net::Limits& limits) : source_(source), limits_(limits) {}

  // What the client sends, whole frames in their order.

  /// Whether what the server will say depends on an end that the client may not have read yet.
  [[nodiscard]] bool is_ambiguous(const proto::Frame& frame) const;
  void sent_on_request(const proto::Frame& frame);
  void sent_on_data(const proto::Frame& frame);
  /// What is no frame.
  void sent_garbage(proto::Channel channel, proto::ErrorCode code);
  void closed(proto::Channel channel);
  /// The server begins to end.
  void server_drains() { draining_ = true; }

  // What the client receives.

  void received_on_request(const proto::Frame& frame);
  void received_on_data(const proto::Frame& frame);

  /// Nothing moves any more and the client has read everything. `heard`: the server has read everything too. `idle`:
  /// nothing holds a request back either.
  void settled(bool session_closed, bool heard, bool idle);

  [[nodiscard]] std::optional<proto::Token> token() const { return token_; }
  [[nodiscard]] proto::SessionState state() const { return state_; }
  /// The server must end the session, or may have.
  [[nodiscard]] bool must_end() const { return !end_codes_.empty(); }
  [[nodiscard]] bool may_be_cut() const { return ended_as_ == proto::ErrorCode::stalled; }
  [[nodiscard]] const std::set<std::uint32_t>& handles() const { return handles_given_; }

 private:
  enum class Kind : std::uint8_t { list, base, next, exact };
  struct Request {
    std::uint64_t order = 0;  ///< in which it was sent
    Kind kind = Kind::list;
    bool over_limit = false;  ///< may be refused as one too many
    bool cancel_sent = false;
    bool had_handles = false;      ///< the client had a handle when it asked
    std::string name;              ///< of a base
    std::uint64_t generation = 0;  ///< asked for by an exact
    std::uint32_t packet = 0;
    std::uint64_t offset = 0;
    std::uint32_t handle = 0;  ///< 0: not known (yet)
    bool opened = false;       ///< mesh_opened came
    // Of its transfer.
    bool begun = false;
    std::uint32_t brings = 0;
    std::uint64_t next = 0;
    std::uint64_t total = 0;
    proto::Bytes page;  ///< of a list
  };
  struct Handle {
    std::uint64_t generation = 0;
    bool dead = false;
    std::set<std::uint32_t> places;  ///< the one of these that the server has
  };
  using Requests = std::map<std::uint32_t, Request>;
  enum class Place : std::uint8_t { front, behind, unknown };

  void ask(std::uint32_t id, Request request);
  void refused(const proto::ErrorMessage& error);
  void check_reason(const Request& request, proto::ErrorCode code) const;
  void opened(const proto::MeshOpened& message);
  void notice(const proto::Notice& notice);
  void ended_by(proto::ErrorCode code);
  void chunk(const proto::ChunkView& chunk);
  void begin(Request& request, const proto::ChunkHeader& header);
  void transfer_end(const proto::TransferEnd& end);
  void expect(std::deque<std::uint32_t>& wanted, std::uint32_t id, const char* what);
  /// Whether all requests that come before this one in the line of its handle are over.
  [[nodiscard]] Place place_in_line(const Request& request) const;
  [[nodiscard]] Request& open_request(std::uint32_t id, const char* what);
  [[nodiscard]] bool may_stall() const;

  const MemorySource& source_;
  const net::Limits& limits_;

  proto::SessionState state_ = proto::SessionState::fresh;
  std::optional<proto::Token> token_;
  bool hello_answered_ = false;
  bool join_answered_ = false;
  bool draining_ = false;
  std::set<proto::ErrorCode> end_codes_;      ///< with which the server may end the session; none: without a word
  std::set<proto::ErrorCode> data_codes_;     ///< that it may name on the data channel
  std::optional<proto::ErrorCode> ended_as_;  ///< as it told
  std::uint64_t order_ = 0;
  std::size_t sent_since_settled_ = 0;

  std::deque<std::uint32_t> pongs_;
  std::deque<std::uint32_t> unknown_types_;
  std::deque<std::uint32_t> data_unknown_types_;
  std::deque<std::uint32_t> not_joined_;
  Requests open_;
  std::map<std::uint32_t, Handle> handles_;
  std::set<std::uint32_t> handles_given_;
};

}  // namespace pmcd::fuzz
