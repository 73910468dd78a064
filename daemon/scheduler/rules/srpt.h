// SPDX-License-Identifier: MIT
// Shortest remaining processing time: who is nearest to the end of what he fetches goes next.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

enum class SrptScope : std::uint8_t {
  mesh,    ///< what is left of the whole mesh
  packet,  ///< of the packet alone
};

/// Smallest remaining time: bytes left over speed. A client not yet measured counts as having the median speed of the
/// measured ones, or the uplink's as long as there are none (not known either: 100 kB/s). [O(log n) an event]
/// Source: L. Schrage, A proof of the optimality of the shortest remaining processing time discipline, Operations
/// Research 16 (1968): it gives the least mean time to completion on one line.
std::unique_ptr<Rule> make_srpt(SrptScope scope, const Surroundings& surroundings);

}  // namespace pmcd::scheduler
