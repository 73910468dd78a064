// SPDX-License-Identifier: MIT
#include "sim/server_stream.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace pmcd::sim {
namespace {

constexpr std::uint64_t kQueuedBytes = 64 * 1024;  ///< as many as the daemon lets wait for a socket

}  // namespace

ServerStream::ServerStream(Timeline& timeline, Connection& connection)
    : timeline_(timeline), connection_(connection), unsent_bound_(std::numeric_limits<std::uint32_t>::max()) {
  connection_.on_writable = [this] { flush(); };
}

bool ServerStream::has_room() const {
  return unwritten() < kQueuedBytes;
}

void ServerStream::queue(std::uint64_t bytes) {
  queued_ += bytes;
  if (std::exchange(flush_is_due_, true)) return;
  timeline_.soon([this] { flush(); });
}

void ServerStream::flush() {
  flush_is_due_ = false;
  if (!is_open_) return;
  written_ += connection_.write(unwritten(), unsent_bound_);
  if (unwritten() > 0) {
    flush_is_due_ = true;
    connection_.call_when_writable(unsent_bound_);
  }
  if (on_progress) on_progress();
}

std::optional<turns::TcpState> ServerStream::tcp_state() {
  turns::TcpState state;
  state.delivery_rate = connection_.delivery_rate();
  state.application_limited = connection_.is_application_limited();
  state.sacked_bytes = connection_.sacked();
  if (std::isfinite(connection_.least_round_trip())) {
    state.least_round_trip = turns::Time(std::llround(connection_.least_round_trip() * 1e9));
  }
  const double silent = timeline_.now() - connection_.last_acknowledgement();
  state.last_acknowledged = std::chrono::milliseconds(static_cast<std::int64_t>(silent * 1000));  // as the kernel does
  return state;
}

}  // namespace pmcd::sim
