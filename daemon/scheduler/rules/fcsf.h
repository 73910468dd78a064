// SPDX-License-Identifier: MIT
// Fastest connection speed first: the packet that is expected to be through soonest goes next.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Shortest expected time: bytes still to send over measured speed; a client not yet measured: time 0. With `burst` 2,
/// after a packet to a fast session (its speed is at least the median of those that wait or run) that session's next
/// request goes at once if it is already waiting, and then no second time. [O(log n) an event]
/// REQUIRES: burst is 1 or 2. Source: Globacnik, CESCG (FCSF, and its variant with two packets in a row).
std::unique_ptr<Rule> make_fcsf(std::uint32_t burst, const Surroundings& surroundings);

}  // namespace pmcd::scheduler
