// SPDX-License-Identifier: MIT
// Coming up, accepting, and the orderly end.
#include "daemon/net/server.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <sstream>
#include <utility>
#include <vector>

#include "daemon/net/on_exit.h"
#include "daemon/store/wall_clock.h"

namespace pmcd::net {
namespace {

// An idle client costs little: its frames are short, so is the buffer in which they are received.
constexpr std::size_t kRequestBuffer = 1024;
constexpr std::size_t kDataBuffer = 256;
constexpr std::size_t kAdminBuffer = 64 * 1024;

/// All of the admin socket's count as one.
AddressTable::Key admin_address() {
  return AddressTable::Key(asio::ip::address_v4::any());
}

std::uint64_t inode_of(const std::string& path) {
  struct stat status {};
  return ::lstat(path.c_str(), &status) == 0 ? status.st_ino : 0;
}

std::string endpoint_text(const asio::ip::tcp::endpoint& endpoint) {
  std::ostringstream text;
  text << endpoint;
  return text.str();
}

}  // namespace

Server::Server(asio::io_context& io, store::StoreThread& reader, store::StoreThread& writer, PolicySources policy,
               ServerOptions options)
    : options_(std::move(options)),
      tasks_(io.get_executor()),
      catalog_(tasks_, reader, writer, {options_.uploads, options_.limits.cache_bytes, options_.limits.grace}),
      policy_(tasks_.executor(), writer, std::move(policy),
              [this](const scheduler::Policy& changed) { dispatcher_.switch_to(changed); }),
      dispatcher_(policy_.policy(), catalog_, tasks_, options_.limits),
      rule_commands_(policy_, dispatcher_, [this] { return session_views(); }),
      answers_(tasks_, options_.limits),
      context_{catalog_, dispatcher_, tokens_, answers_, options_.limits, 0, "pmcd " + options_.version, false},
      admin_context_{catalog_, options_.limits, "pmcd " + options_.version, [this] { return status(); },
                     rule_commands_},
      refusals_(tasks_, options_.limits, context_.log),
      requests_(io),
      data_(io),
      admin_(io),
      session_addresses_(options_.limits.sessions_per_address) {
  catalog_.on_retired([this](store::MeshId mesh, Duration grace) {
    for (const auto& [key, weak] : sessions_) {
      if (const auto session = weak.lock()) session->mesh_retired(mesh, grace);
    }
  });
}

Server::~Server() {
  close_listeners();
}

std::optional<std::string> Server::start() {
  auto requests = listen_tcp(tasks_.executor(), options_.listen, options_.request_port);
  if (auto* error = std::get_if<ListenError>(&requests)) return error->text;
  auto data = listen_tcp(tasks_.executor(), options_.listen, options_.data_port);
  if (auto* error = std::get_if<ListenError>(&data)) return error->text;
  auto admin = listen_unix(tasks_.executor(), options_.admin_socket);
  if (auto* error = std::get_if<ListenError>(&admin)) return error->text;
  requests_ = std::move(std::get<TcpAcceptor>(requests));
  data_ = std::move(std::get<TcpAcceptor>(data));
  admin_ = std::move(std::get<UnixAcceptor>(admin));
  admin_inode_ = inode_of(options_.admin_socket);
  request_port_ = requests_.local_endpoint().port();
  context_.data_port = data_.local_endpoint().port();
  started_ = Clock::now();
  started_at_ = store::seconds_since_1970();
  tasks_.spawn("leftovers", catalog_.collect_leftovers());
  spdlog::info("listening on {}, request port {}, data port {}, admin socket {}", options_.listen, request_port_,
               context_.data_port, options_.admin_socket);
  tasks_.spawn("request listener",
               accept_loop(requests_, "request port", [this](auto socket) { accept_request(std::move(socket)); }));
  tasks_.spawn("data listener",
               accept_loop(data_, "data port", [this](auto socket) { accept_data(std::move(socket)); }));
  tasks_.spawn("admin listener",
               accept_loop(admin_, "admin socket", [this](auto socket) { accept_admin(std::move(socket)); }));
  return std::nullopt;
}

void Server::accept_request(TcpSocket socket) {
  tune_tcp(socket.native_handle());
  bound_send_buffer(socket.native_handle(), options_.limits.queued_bytes);
  error_code error;
  const auto endpoint = socket.remote_endpoint(error);
  if (error) return;  // it is gone already
  auto channel = std::make_shared<Channel>(std::move(socket), options_.limits, proto::kMaxClientFrame, kRequestBuffer);
  const AddressTable::Key address(endpoint.address());
  if (sessions_.size() >= options_.limits.sessions) {
    refusals_.turn_away(std::move(channel), address, proto::ErrorCode::too_many_sessions,
                        "the daemon serves as many sessions as it may; try again later");
    return;
  }
  if (!session_addresses_.enter(address)) {
    refusals_.turn_away(std::move(channel), address, proto::ErrorCode::too_many_sessions,
                        "your address has as many sessions as it may");
    return;
  }
  const std::uint64_t key = next_key_++;
  auto session = std::make_shared<Session>(key, endpoint_text(endpoint), std::move(channel), context_);
  sessions_.emplace(key, session);
  tasks_.spawn("session", serve_session(std::move(session), address));
}

void Server::accept_data(TcpSocket socket) {
  tune_tcp(socket.native_handle());
  error_code error;
  const auto endpoint = socket.remote_endpoint(error);
  if (error) return;
  auto channel = std::make_shared<Channel>(std::move(socket), options_.limits, proto::kMaxClientFrame, kDataBuffer);
  const AddressTable::Key address(endpoint.address());
  // Together with those that have joined: descriptors are counted on for one data connection a session.
  if (data_connections_ >= options_.limits.sessions + options_.limits.spare_data_connections ||
      !may_join_from(address)) {
    refusals_.turn_away(std::move(channel), address, proto::ErrorCode::too_many_sessions,
                        "too many data connections wait to join");
    return;
  }
  joining_addresses_.enter(address);
  ++data_connections_;
  tasks_.spawn("data channel", serve_data(std::move(channel), address));
}

bool Server::may_join_from(const AddressTable::Key& address) const {
  const std::size_t sessions = session_addresses_.count(address);
  const std::size_t joined = joined_addresses_.count(address);
  const std::size_t awaited = sessions > joined ? sessions - joined : 0;
  return joining_addresses_.count(address) < awaited + options_.limits.stray_data_connections;
}

void Server::accept_admin(UnixSocket socket) {
  const auto peer = peer_identity(socket.native_handle());
  auto channel = std::make_shared<Channel>(std::move(socket), options_.limits, proto::kMaxAdminFrame, kAdminBuffer);
  if (context_.draining || admins_.size() >= options_.limits.admin_connections) {
    refusals_.turn_away(std::move(channel), admin_address(),
                        context_.draining ? proto::ErrorCode::shutting_down : proto::ErrorCode::too_many_sessions,
                        "no more admin connections are taken now");
    return;
  }
  const std::uint64_t key = next_key_++;
  auto connection = std::make_shared<AdminConnection>(std::move(channel), peer, admin_context_);
  admins_.emplace(key, connection);
  tasks_.spawn("admin connection", serve_admin(key, std::move(connection)));
}

awaitable<void> Server::serve_session(std::shared_ptr<Session> session, AddressTable::Key address) {
  const OnExit place([this, &session, &address] {
    session->close(proto::ErrorCode::none, "ended by an exception");  // no effect on one that ended in order
    sessions_.erase(session->key());
    session_addresses_.leave(address);
  });
  co_await session->run(session);
}

awaitable<void> Server::serve_admin(std::uint64_t key, std::shared_ptr<AdminConnection> connection) {
  const OnExit place([this, key] { admins_.erase(key); });
  co_await connection->run(connection);
}

awaitable<void> Server::serve_data(std::shared_ptr<Channel> channel, AddressTable::Key address) {
  const OnExit place([this] { --data_connections_; });
  co_await let_join(std::move(channel), address);
}

awaitable<Channel::Incoming> Server::first_frame(std::shared_ptr<Channel> channel, AddressTable::Key address) {
  const std::uint64_t key = next_key_++;
  const OnExit place([this, key, &address] {
    joining_.erase(key);
    joining_addresses_.leave(address);
  });
  joining_.emplace(key, channel);
  co_return co_await channel->read(Clock::now() + options_.limits.hello);
}

awaitable<void> Server::let_join(std::shared_ptr<Channel> channel, AddressTable::Key address) {
  const Channel::Incoming incoming = co_await first_frame(channel, address);
  proto::Error refusal;
  if (std::holds_alternative<Channel::Closed>(incoming)) {
    co_await channel->finish();
    co_return;
  }
  if (std::holds_alternative<Channel::TimedOut>(incoming)) {
    refusal = {proto::ErrorCode::join_timeout, 0, "no join came in time"};
  } else if (const auto* error = std::get_if<proto::Error>(&incoming)) {
    refusal = *error;
  } else {
    const auto& frame = std::get<proto::Frame>(incoming);
    refusal.code = proto::check_client_frame(proto::Channel::data, proto::SessionState::fresh, frame.type);
    refusal.detail = "the first frame must be join";
    if (refusal.code == proto::ErrorCode::none) {
      const auto join = proto::decode<proto::Join>(frame.body);
      if (!join) {
        refusal = join.error();
      } else if (const auto session = tokens_.redeem(join.value().token)) {
        joined_addresses_.enter(address);
        const OnExit joined([this, &address] { joined_addresses_.leave(address); });
        co_await session->run_data(std::move(channel));
        co_return;
      } else {
        refusal = {proto::ErrorCode::bad_token, 0, "the token is unknown, used or too old"};
      }
    }
  }
  refusals_.turn_away(std::move(channel), address, refusal.code, refusal.detail);
}

awaitable<bool> Server::drain() {
  context_.draining = true;
  dispatcher_.drain();
  for (const auto& [key, weak] : sessions_) {
    if (const auto session = weak.lock()) session->server_drains(options_.limits.drain);
  }
  spdlog::info("draining: {} transfers are running, {} requests wait", dispatcher_.running(), dispatcher_.waiting());
  if (!co_await dispatcher_.wait_idle(options_.limits.drain)) {
    spdlog::warn("{} transfers did not end in time and are cut off", dispatcher_.running());
  }
  close_listeners();
  const auto sessions = std::exchange(sessions_, {});
  for (const auto& [key, weak] : sessions) {
    if (const auto session = weak.lock()) session->close(proto::ErrorCode::shutting_down, "the daemon is ending");
  }
  for (const auto& [key, weak] : joining_) {
    if (const auto channel = weak.lock()) channel->stop_reading();
  }
  for (const auto& [key, weak] : admins_) {
    if (const auto connection = weak.lock()) connection->stop();
  }
  catalog_.stop();
  // Lingering ends by itself; a commit that is under way may take longer.
  co_return co_await tasks_.wait_idle(options_.limits.linger + options_.limits.drain);
}

void Server::close_listeners() {
  error_code ignored;
  requests_.close(ignored);
  data_.close(ignored);
  if (!admin_.is_open()) return;
  admin_.close(ignored);
  // Only our own file: somebody may have put another in its place.
  if (inode_of(options_.admin_socket) == admin_inode_) ::unlink(options_.admin_socket.c_str());
}

std::vector<SessionView> Server::session_views() const {
  std::vector<SessionView> views;
  for (const auto& [key, weak] : sessions_) {
    if (const auto session = weak.lock(); session && !session->closed()) views.push_back(session->view(Clock::now()));
  }
  return views;
}

StatusReport Server::status() const {
  StatusReport report;
  report.version = options_.version;
  report.rule = dispatcher_.policy().rule;
  report.slots = dispatcher_.policy().slots;
  report.sessions = sessions_.size();
  report.session_limit = options_.limits.sessions;
  report.cache = catalog_.cache_status();
  report.waiting = dispatcher_.waiting();
  report.running = dispatcher_.running();
  report.listen = options_.listen;
  report.request_port = request_port_;
  report.data_port = context_.data_port;
  report.started_at = started_at_;
  report.uptime_seconds = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - started_).count();
  return report;
}

}  // namespace pmcd::net
