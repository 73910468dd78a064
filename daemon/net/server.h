// SPDX-License-Identifier: MIT
// The network side of the daemon as one object: two TCP listeners, the admin socket, the sessions, and how all of it
// comes up, drains and ends. One thread runs its io_context; the store has its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/net/address_table.h"
#include "daemon/net/admin_connection.h"
#include "daemon/net/asio.h"
#include "daemon/net/catalog.h"
#include "daemon/net/dispatcher.h"
#include "daemon/net/join_table.h"
#include "daemon/net/limits.h"
#include "daemon/net/listener.h"
#include "daemon/net/policy_keeper.h"
#include "daemon/net/refusals.h"
#include "daemon/net/rule_commands.h"
#include "daemon/net/session.h"
#include "daemon/net/task_group.h"
#include "daemon/store/store_thread.h"

namespace pmcd::net {

struct ServerOptions {
  std::string listen = "127.0.0.1";
  std::uint16_t request_port = proto::kDefaultRequestPort;  ///< 0: any free port
  std::uint16_t data_port = proto::kDefaultDataPort;        ///< 0: any free port
  std::string admin_socket;
  std::string version;  ///< of the daemon, for agents and status
  Limits limits;
  store::UploadLimits uploads;
};

class Server {
 public:
  /// REQUIRES: the io_context and the threads outlive the server, and once start() succeeded, drain() has ended before
  /// the server goes.
  Server(asio::io_context& io, store::StoreThread& reader, store::StoreThread& writer, PolicySources policy,
         ServerOptions options);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Opens the listeners and begins to accept. A sentence if that is not possible.
  std::optional<std::string> start();

  /// Takes nothing new, lets running transfers end (at most limits.drain), closes everybody, and returns when nothing
  /// is left. False if something would not end.
  awaitable<bool> drain();

  [[nodiscard]] std::uint16_t request_port() const { return request_port_; }
  [[nodiscard]] std::uint16_t data_port() const { return context_.data_port; }
  [[nodiscard]] std::size_t sessions() const { return sessions_.size(); }
  /// Turns that a quantum has ended.
  [[nodiscard]] std::uint64_t interruptions() const { return dispatcher_.interruptions(); }
  [[nodiscard]] const scheduler::Policy& policy() const { return dispatcher_.policy(); }

 private:
  void accept_request(TcpSocket socket);
  void accept_data(TcpSocket socket);
  void accept_admin(UnixSocket socket);
  /// Whether an address may have one more data connection that has not joined: one for each of its sessions that waits
  /// for one, and a few more, as a network may send a client's second connection from another address.
  [[nodiscard]] bool may_join_from(const AddressTable::Key& address) const;
  awaitable<void> serve_session(std::shared_ptr<Session> session, AddressTable::Key address);
  awaitable<void> serve_data(std::shared_ptr<Channel> channel, AddressTable::Key address);
  /// Its first frame, and its place among those that wait to join until then.
  awaitable<Channel::Incoming> first_frame(std::shared_ptr<Channel> channel, AddressTable::Key address);
  /// Judges that frame, which is to join a session.
  awaitable<void> let_join(std::shared_ptr<Channel> channel, AddressTable::Key address);
  awaitable<void> serve_admin(std::uint64_t key, std::shared_ptr<AdminConnection> connection);
  void close_listeners();
  StatusReport status() const;
  std::vector<SessionView> session_views() const;

  const ServerOptions options_;
  TaskGroup tasks_;
  Catalog catalog_;
  PolicyKeeper policy_;
  Dispatcher dispatcher_;
  RuleCommands rule_commands_;
  JoinTable tokens_;
  AnswerWatch answers_;
  SessionContext context_;
  AdminContext admin_context_;
  Refusals refusals_;
  TcpAcceptor requests_;
  TcpAcceptor data_;
  UnixAcceptor admin_;
  std::uint16_t request_port_ = 0;
  std::uint64_t next_key_ = 1;
  AddressTable session_addresses_;
  AddressTable joining_addresses_;  ///< of data connections that have not joined yet
  AddressTable joined_addresses_;   ///< of those that have
  std::map<std::uint64_t, std::weak_ptr<Session>> sessions_;
  std::map<std::uint64_t, std::weak_ptr<AdminConnection>> admins_;
  std::map<std::uint64_t, std::weak_ptr<Channel>> joining_;  ///< data connections that have not joined yet
  std::size_t data_connections_ = 0;                         ///< those and the ones that have joined
  std::uint64_t admin_inode_ = 0;
  Clock::time_point started_;
  std::int64_t started_at_ = 0;
};

}  // namespace pmcd::net
