// SPDX-License-Identifier: MIT
// One client: its request channel, its data channel once that has joined, the handshake of both, and the one way in
// which a session ends. What its requests lead to stands in session_requests.h, the rules of what is allowed when in
// proto/session.h. It decides no order among clients.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/net/answer_watch.h"
#include "daemon/net/channel.h"
#include "daemon/net/dispatcher.h"
#include "daemon/net/join_table.h"
#include "daemon/net/log_budget.h"
#include "daemon/net/mesh_source.h"
#include "daemon/net/queue_view.h"
#include "daemon/net/session_requests.h"
#include "proto/session.h"

namespace pmcd::net {

/// What all sessions of a server share. REQUIRES: outlives them.
struct SessionContext {
  MeshSource& meshes;
  Dispatcher& dispatcher;
  JoinTable& tokens;
  AnswerWatch& answers;
  const Limits& limits;
  std::uint16_t data_port = 0;
  std::string agent;  ///< name and version of the daemon
  bool draining = false;
  LogBudget log{};       ///< for what strangers cause by coming and going
  LogBudget damage{10};  ///< for what they cause by asking for what cannot be read
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  /// `key`: unique for the life of the server. `peer`: for the log.
  Session(std::uint64_t key, std::string peer, std::shared_ptr<Channel> requests, SessionContext& context);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// The life of the request channel: hello, then requests until it ends. Once it returns, the session is closed.
  /// `self` keeps the session alive from the spawning on.
  awaitable<void> run(std::shared_ptr<Session> self);

  /// The life of a data channel that has redeemed this session's token.
  awaitable<void> run_data(std::shared_ptr<Channel> data);

  /// Ends the session, once: `code` (none: without a word) is sent on the request channel, requests leave the queue,
  /// both channels close.
  void close(proto::ErrorCode code, std::string_view why);
  [[nodiscard]] bool closed() const { return closed_; }

  /// The server is ending: running transfers have `left` to end.
  void server_drains(Duration left);
  /// See SessionRequests.
  void mesh_retired(store::MeshId mesh, Duration grace);

  [[nodiscard]] std::uint64_t key() const { return key_; }
  /// The session as an operator sees it.
  [[nodiscard]] SessionView view(Clock::time_point now) const;
  /// Whether a line on something unreadable may be written now.
  [[nodiscard]] bool may_log_damage() { return context_.damage.take(); }
  [[nodiscard]] const std::string& peer() const { return peer_; }
  /// REQUIRES: joined, as every session with a transfer is.
  [[nodiscard]] Channel& data() { return *data_; }
  [[nodiscard]] SessionRequests& requests() { return requests_; }

  /// Whether the client has not acknowledged yet all that was queued on the request channel. Closes the session if it
  /// has acknowledged nothing for limits.stall.
  bool owes_answers(Clock::time_point now);

  /// Queues a frame on the request channel.
  void send(proto::Bytes frame);
  void send_error(std::uint32_t id, proto::ErrorCode code, std::string_view text);
  /// Queues a frame on the data channel; closes the session when too many wait there. REQUIRES: joined.
  void send_on_data(proto::Bytes frame);

 private:
  awaitable<bool> greet();
  bool on_hello(const proto::Frame& frame);
  /// False when the session is to end.
  awaitable<bool> on_frame(const proto::Frame& frame);
  void on_data_frame(const proto::Frame& frame);
  void close_data(bool at_once);

  const std::uint64_t key_;
  const std::string peer_;
  const Clock::time_point connected_at_ = Clock::now();
  const std::shared_ptr<Channel> request_channel_;
  std::shared_ptr<Channel> data_;
  SessionContext& context_;
  proto::SessionState state_ = proto::SessionState::fresh;
  bool closed_ = false;
  bool answers_watched_ = false;
  proto::Token token_{};
  std::optional<Clock::time_point> deadline_;  ///< of hello, then of join
  SessionRequests requests_;
};

}  // namespace pmcd::net
