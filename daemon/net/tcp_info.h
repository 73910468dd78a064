// SPDX-License-Identifier: MIT
// What the kernel measures of a TCP connection, as plain numbers. Apart from socket_state.h because the kernel's
// header, which alone has all of it, cannot be included beside the C library's.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace pmcd::net {

struct TcpInfo {
  double delivery_rate = 0;         ///< bytes a second, of the last round trip with enough to send
  bool application_limited = true;  ///< that was not enough: the rate says what was sent, not what could be
  std::uint64_t sacked_bytes = 0;   ///< about: received beyond a segment that is missing, and so not acknowledged yet
  std::chrono::microseconds least_round_trip{0};   ///< 0: not known
  std::chrono::milliseconds last_acknowledged{0};  ///< so long ago the last acknowledgement came
};

/// TCP_INFO of a socket; none if it is not TCP or no longer open. One system call.
std::optional<TcpInfo> tcp_info(int socket);

}  // namespace pmcd::net
