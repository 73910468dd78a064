// SPDX-License-Identifier: MIT
// One client: its request channel, its data channel once that has joined, the meshes that it has opened and how far it
// has come in each. Answers its requests or hands them to the dispatcher; one channel lost, both close.
// The rules of what is allowed when stand in proto/session.h. It decides no order among clients.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/net/channel.h"
#include "daemon/net/dispatcher.h"
#include "daemon/net/join_table.h"
#include "proto/session.h"

namespace pmcd::net {

/// What all sessions of a server share. REQUIRES: outlives them.
struct SessionContext {
  Catalog& catalog;
  Dispatcher& dispatcher;
  JoinTable& tokens;
  const Limits& limits;
  std::uint16_t data_port = 0;
  std::string agent;  ///< name and version of the daemon
  bool draining = false;
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

  [[nodiscard]] std::uint64_t key() const { return key_; }
  [[nodiscard]] const std::string& peer() const { return peer_; }
  /// REQUIRES: joined, as every session with a transfer is.
  [[nodiscard]] Channel& data() { return *data_; }

  /// Transfer `id` has all its chunks queued: queues its end behind them and moves the place in the mesh.
  void transfer_sent(const Transfer& transfer);
  /// Transfer `id` cannot be sent; no chunk of it was queued.
  void transfer_failed(const Transfer& transfer, const store::Error& error);

 private:
  /// A request that waits its turn among those of its mesh.
  struct Ask {
    std::uint32_t id = 0;
    bool base = false;
    Clock::time_point at;
  };

  struct OpenMesh {
    std::shared_ptr<const CatalogMesh> mesh;
    std::uint32_t place = 0;  ///< the packet that get_next_packet brings
    std::deque<Ask> line;     ///< served one after the other; the first is with the dispatcher if `busy`
    bool busy = false;
    proto::ErrorCode dead = proto::ErrorCode::none;  ///< why the handle is of no use any more
  };

  awaitable<bool> greet();
  /// Whether the data channel takes its answers; if not, the session is closed.
  bool data_keeps_up();
  bool on_hello(const proto::Frame& frame);
  /// False when the session is to end.
  awaitable<bool> on_frame(const proto::Frame& frame);
  awaitable<bool> on_request(proto::FrameType type, proto::ByteView body);
  awaitable<void> list_meshes(std::uint32_t id);
  awaitable<void> open_mesh(std::uint32_t id, std::string name);
  void next_packet(std::uint32_t id, std::uint32_t handle);

  std::uint32_t handle_of(const std::shared_ptr<const CatalogMesh>& mesh);
  /// Starts the first request in the line of a mesh, unless one is under way.
  void advance(std::uint32_t handle);
  void refuse(std::uint32_t id, proto::ErrorCode code, std::string_view text);
  void send_error(Channel& channel, std::uint32_t id, proto::ErrorCode code, std::string_view text);

  const std::uint64_t key_;
  const std::string peer_;
  const std::shared_ptr<Channel> requests_;
  std::shared_ptr<Channel> data_;
  SessionContext& context_;
  proto::SessionState state_ = proto::SessionState::fresh;
  bool closed_ = false;
  proto::Token token_{};
  std::optional<Clock::time_point> deadline_;  ///< of hello, then of join
  proto::OpenRequests open_;
  std::map<std::uint32_t, OpenMesh> meshes_;  ///< by handle
  std::uint32_t last_handle_ = 0;
  std::uint32_t next_handle_ = 1;
};

}  // namespace pmcd::net
