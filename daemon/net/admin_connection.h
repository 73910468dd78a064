// SPDX-License-Identifier: MIT
// One operator's connection to the admin socket: hello, then one command after the other. Each command is logged with
// the uid and pid that the kernel names. It decides nobody's rights: the mode of the socket file does.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/net/admin_json.h"
#include "daemon/net/catalog.h"
#include "daemon/net/channel.h"
#include "daemon/net/limits.h"
#include "daemon/net/rule_commands.h"
#include "daemon/net/socket_state.h"
#include "proto/admin.h"
#include "proto/session.h"

namespace pmcd::net {

/// What all admin connections share. REQUIRES: outlives them.
struct AdminContext {
  Catalog& catalog;
  const Limits& limits;
  std::string agent;
  std::function<StatusReport()> status;  ///< all but the number of meshes
  RuleCommands& rules;
};

class AdminConnection {
 public:
  AdminConnection(std::shared_ptr<Channel> channel, std::optional<PeerIdentity> peer, AdminContext& context);
  AdminConnection(const AdminConnection&) = delete;
  AdminConnection& operator=(const AdminConnection&) = delete;

  /// The life of the connection. `self` keeps it alive.
  awaitable<void> run(std::shared_ptr<AdminConnection> self);
  /// Lets the command that is under way finish, then ends.
  void stop() { channel_->stop_reading(); }

 private:
  /// The ingest that is under way on this connection.
  struct Ingest {
    std::uint32_t id = 0;
    std::string name;
    Catalog::SharedUpload upload;  ///< null once it failed: what still comes of it is dropped
  };

  bool on_hello(const proto::Frame& frame);
  /// False when the connection is to end.
  awaitable<bool> on_frame(const proto::Frame& frame);
  awaitable<bool> on_command(proto::FrameType type, proto::ByteView body);

  awaitable<void> list(std::uint32_t id);
  awaitable<void> show(std::uint32_t id, std::string name);
  awaitable<void> remove(std::uint32_t id, std::string name);
  awaitable<void> status(std::uint32_t id);
  /// A command about rule, queue or clients; false, and the connection is to end, if it is none or has not its form.
  awaitable<bool> rule_command(proto::FrameType type, proto::ByteView body);
  awaitable<bool> ingest_begin(proto::IngestBegin message);
  awaitable<bool> ingest_data(proto::IngestDataView data);
  awaitable<bool> ingest_commit(std::uint32_t id);
  void ingest_failed(const store::Error& error);

  awaitable<void> answer(std::vector<proto::Bytes> frames);
  void refuse(std::uint32_t id, const store::Error& error);
  void send_error(std::uint32_t id, proto::ErrorCode code, std::string_view text);
  /// Sends an error that ends the connection; always false.
  bool end_with(proto::ErrorCode code, std::string_view text);
  void log(std::string_view command, std::string_view name, std::string_view result) const;

  const std::shared_ptr<Channel> channel_;
  const PeerIdentity peer_;
  const std::string who_;
  AdminContext& context_;
  proto::SessionState state_ = proto::SessionState::fresh;
  std::optional<Ingest> ingest_;
};

}  // namespace pmcd::net
