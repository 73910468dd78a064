// SPDX-License-Identifier: MIT
// The ioctl and socket options that Asio does not wrap.
#include "daemon/net/socket_state.h"

#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <climits>

namespace pmcd::net {
namespace {

void set_option(int socket, int level, int option, int value) {
  static_cast<void>(::setsockopt(socket, level, option, &value, sizeof value));
}

std::uint64_t queue_bytes(int socket, unsigned long which) {
  int bytes = 0;
  if (::ioctl(socket, which, &bytes) != 0 || bytes < 0) return 0;
  return static_cast<std::uint64_t>(bytes);
}

int fitting(std::size_t bytes) {
  return static_cast<int>(std::min<std::size_t>(bytes, INT_MAX));
}

}  // namespace

std::uint64_t unacknowledged_bytes(int socket) {
  return queue_bytes(socket, SIOCOUTQ);
}

std::uint64_t unsent_bytes(int socket) {
  return queue_bytes(socket, SIOCOUTQNSD);
}

void bound_unsent(int socket, std::size_t bytes) {
  set_option(socket, IPPROTO_TCP, TCP_NOTSENT_LOWAT, fitting(bytes));
}

std::optional<PeerIdentity> peer_identity(int socket) {
  ucred credentials{};
  socklen_t length = sizeof credentials;
  if (::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &credentials, &length) != 0) return std::nullopt;
  return PeerIdentity{credentials.uid, credentials.pid};
}

void tune_tcp(int socket) {
  // Each of these is a courtesy: a socket without it works.
  set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, 60);
  set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, 15);
  set_option(socket, IPPROTO_TCP, TCP_KEEPCNT, 4);
  set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
}

void bound_send_buffer(int socket, std::size_t bytes) {
  set_option(socket, SOL_SOCKET, SO_SNDBUF, fitting(bytes));
}

}  // namespace pmcd::net
