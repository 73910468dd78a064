// SPDX-License-Identifier: MIT
// What the kernel measures of a TCP connection, as plain numbers. Apart from socket_state.h because the kernel's
// header, which alone has all of it, cannot be included beside the C library's.
#pragma once

#include <optional>

#include "daemon/turns/stream.h"

namespace pmcd::net {

/// TCP_INFO of a socket; none if it is not TCP or no longer open. One system call.
std::optional<turns::TcpState> tcp_state(int socket);

}  // namespace pmcd::net
