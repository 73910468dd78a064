// SPDX-License-Identifier: MIT
// Plain system calls: Asio's would need a socket of the right type, and there are two.
#include "daemon/net/farewell.h"

#include <sys/socket.h>

#include <array>
#include <cstddef>

namespace pmcd::net {

void say_farewell(int socket, proto::ByteView frame) {
  // The send buffer of a fresh socket is empty and holds any frame; if not, the peer sees the end without the reason.
  static_cast<void>(::send(socket, frame.data(), frame.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
  static_cast<void>(::shutdown(socket, SHUT_WR));
  // Bytes that are unread at close would turn the end into a reset.
  constexpr int kMostReads = 16;
  std::array<std::byte, 4096> forgotten{};
  for (int i = 0; i < kMostReads; ++i) {
    if (::recv(socket, forgotten.data(), forgotten.size(), MSG_DONTWAIT) <= 0) break;
  }
}

}  // namespace pmcd::net
