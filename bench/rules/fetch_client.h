// SPDX-License-Identifier: MIT
// One client of an experiment: fetches one mesh and notes when each packet was there. It decodes nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace pmcd::bench {

struct ClientOptions {
  std::string address;
  std::uint16_t port = 0;
  std::string mesh;
  std::size_t open = 1;  ///< requests that it keeps open
  /// Seconds of CLOCK_MONOTONIC at which it connects, so that many clients begin as planned however long each took to
  /// start; none: now.
  std::optional<double> start_at;
  double delay_start = 0;  ///< seconds after that
  /// Behind this packet it takes nothing more from the data channel, but keeps asking and stays until it is dropped.
  std::optional<std::uint32_t> stall_after;
  /// Behind this packet it closes both channels.
  std::optional<std::uint32_t> leave_after;
};

/// Runs the client to its end, or until SIGTERM or SIGINT. Times are seconds since its start (`start_at` and
/// `delay_start`): `connected` (the request channel), `joined`, `opened` (mesh_opened is there), for each packet when
/// its last byte had come and was found right, and `finished`, when the last of them was there. `ended` is "complete",
/// "stalled" (it did, on purpose), "left" (likewise), "interrupted", or "dropped" by the daemon, then `why` says more.
/// A byte that is not what the level directory announces, or a frame out of place, ends the program by fail().
nlohmann::json fetch_mesh(const ClientOptions& options);

}  // namespace pmcd::bench
