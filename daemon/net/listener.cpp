// SPDX-License-Identifier: MIT
// Opening of listening sockets; what may be done to a socket file that is there already.
#include "daemon/net/listener.h"

#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace pmcd::net {
namespace {

constexpr mode_t kSocketMode = 0660;

/// Whether the path is free now; else a sentence that says what stands there.
std::optional<std::string> make_room(const std::string& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0) {
    if (errno == ENOENT) return std::nullopt;
    return path + ": " + std::strerror(errno);
  }
  if (!S_ISSOCK(status.st_mode)) return path + " exists and is not a socket";
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (probe < 0) return path + ": " + std::strerror(errno);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const int result = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int reason = errno;
  ::close(probe);
  if (result == 0 || reason == EAGAIN) return "another program answers on " + path + "; is a pmcd running already?";
  if (reason != ECONNREFUSED) return path + ": " + std::strerror(reason);
  spdlog::info("{}: nobody answers, the stale socket file is replaced", path);
  if (::unlink(path.c_str()) != 0) return path + ": " + std::strerror(errno);
  return std::nullopt;
}

}  // namespace

ListenResult<TcpAcceptor> listen_tcp(const Executor& executor, const std::string& address, std::uint16_t port) {
  const std::string where = address + " port " + std::to_string(port);
  error_code error;
  const auto ip = asio::ip::make_address(address, error);
  if (error) return ListenError{"\"" + address + "\" is not an IP address"};
  const asio::ip::tcp::endpoint endpoint(ip, port);
  TcpAcceptor acceptor(executor);
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(TcpAcceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return ListenError{"cannot listen on " + where + ": " + error.message()};
  return acceptor;
}

ListenResult<UnixAcceptor> listen_unix(const Executor& executor, const std::string& path) {
  if (path.empty() || path.size() >= sizeof(sockaddr_un::sun_path)) {
    return ListenError{"the path of the admin socket must have 1 to " +
                       std::to_string(sizeof(sockaddr_un::sun_path) - 1) + " bytes: \"" + path + "\""};
  }
  if (const auto obstacle = make_room(path)) return ListenError{*obstacle};
  UnixAcceptor acceptor(executor);
  error_code error;
  acceptor.open(asio::local::stream_protocol(), error);
  // Before bind, so that the file never has a wider mode; and after it, because the umask takes bits away.
  if (!error && ::fchmod(acceptor.native_handle(), kSocketMode) != 0) {
    return ListenError{path + ": " + std::strerror(errno)};
  }
  if (!error) acceptor.bind(asio::local::stream_protocol::endpoint(path), error);
  if (error) return ListenError{"cannot listen on " + path + ": " + error.message()};
  if (::chmod(path.c_str(), kSocketMode) != 0) return ListenError{path + ": " + std::strerror(errno)};
  acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error) return ListenError{"cannot listen on " + path + ": " + error.message()};
  return acceptor;
}

awaitable<void> AcceptTrouble::pause(const error_code& error) {
  if (in_a_row_++ == 0) spdlog::error("{}: accept: {}; trying again every 100 ms", name_, error.message());
  co_await sleep_for(executor_, std::chrono::milliseconds(100));
}

void AcceptTrouble::not_served(const std::exception& failure) const {
  spdlog::error("{}: a connection could not be served: {}", name_, failure.what());
}

void AcceptTrouble::over() {
  if (in_a_row_ > 0) spdlog::info("{}: accepting again after {} failed tries", name_, in_a_row_);
  in_a_row_ = 0;
}

}  // namespace pmcd::net
