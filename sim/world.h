// SPDX-License-Identifier: MIT
// A run: clients that connect, ask, receive and decode, and the daemon's side between them and the uplink. The same
// scenario and policy give the same outcome to the last bit. It prints nothing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "daemon/scheduler/policy.h"
#include "sim/scenario.h"

namespace pmcd::sim {

/// A time that never came.
inline constexpr double kNever = -1;

/// One mesh on its way to one client. Times in seconds since the client began with it: since it connected for its first
/// mesh, since it asked for others; kNever where it did not come so far.
struct Fetch {
  std::uint32_t client = 0;
  std::uint32_t mesh = 0;
  bool is_first = true;  ///< of the client's, so that it begins with connecting
  double begins = 0;     ///< seconds since the run began
  double first_level = kNever;
  std::array<double, kErrorParts.size()> to_error{kNever, kNever, kNever};
  double complete = kNever;
};

struct Outcome {
  std::vector<Fetch> fetches;       ///< by client, then in the order in which it fetched; only those that were begun
  double link_use = 0;              ///< part of the uplink's capacity that was used from the first chunk to the last
  double seconds = 0;               ///< from the first client's arrival to the last chunk
  std::uint64_t payload_bytes = 0;  ///< that came through, of packets
  std::uint64_t chunks = 0;
  std::uint64_t events = 0;
  std::uint64_t dropped = 0;  ///< clients that took nothing for too long
};

/// REQUIRES: the policy's rule exists; lines and meshes of all clients exist; open > 0. [O(n log n) for n chunks, where
/// the rule is not dearer]
Outcome simulate(const Scenario& scenario, const scheduler::Policy& policy);

/// Seconds that a fetch takes at least: what it would if its client had the uplink for itself and everything were asked
/// for at once.
double best_time(const Scenario& scenario, const Fetch& fetch);

}  // namespace pmcd::sim
