// SPDX-License-Identifier: MIT
// A run over the network of packets: the same clients as in world.h, whose connections, requests and segments go
// through queues one by one. Dearer than the fluid by far, and as true as bench/rules can tell.
#pragma once

#include "daemon/scheduler/policy.h"
#include "sim/scenario.h"
#include "sim/world.h"

namespace pmcd::sim {

/// REQUIRES: as simulate(). [O(n log n) for n segments]
Outcome simulate_packets(const Scenario& scenario, const scheduler::Policy& policy);

}  // namespace pmcd::sim
