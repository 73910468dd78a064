// SPDX-License-Identifier: MIT
// A kernel may know less than this header: what it did not fill in is left at its default.
#include "daemon/net/tcp_info.h"

#include <linux/tcp.h>
#include <sys/socket.h>

#include <cstddef>
#include <cstdint>

namespace pmcd::net {
namespace {

constexpr int kTcpLevel = 6;  // IPPROTO_TCP, whose header clashes with the one above

}  // namespace

std::optional<turns::TcpState> tcp_state(int socket) {
  ::tcp_info raw{};
  socklen_t length = sizeof raw;
  if (::getsockopt(socket, kTcpLevel, TCP_INFO, &raw, &length) != 0) return std::nullopt;
  turns::TcpState info;
  info.last_acknowledged = std::chrono::milliseconds(raw.tcpi_last_ack_recv);
  info.sacked_bytes = std::uint64_t{raw.tcpi_sacked} * raw.tcpi_snd_mss;
  constexpr std::size_t kNeeded = offsetof(::tcp_info, tcpi_delivery_rate) + sizeof raw.tcpi_delivery_rate;
  if (length < kNeeded) return info;
  info.delivery_rate = static_cast<double>(raw.tcpi_delivery_rate);
  info.application_limited = raw.tcpi_delivery_rate_app_limited != 0;
  // The kernel says "not seen yet" by the largest number.
  if (raw.tcpi_min_rtt != UINT32_MAX) info.least_round_trip = std::chrono::microseconds(raw.tcpi_min_rtt);
  return info;
}

}  // namespace pmcd::net
