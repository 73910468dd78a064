// SPDX-License-Identifier: MIT
// Policies as they are written on the simulator's command line, in the daemon's own names and with its own errors.
#pragma once

#include <string>
#include <vector>

#include "daemon/scheduler/policy.h"
#include "sim/problem.h"

namespace pmcd::sim {

/// One policy for each rule ("all": every rule there is), in that order. `options`: "NAME=VALUE"; one that only one
/// rule has is for that rule and must have it among `rules`.
Result<std::vector<scheduler::Policy>> read_policies(const std::vector<std::string>& rules,
                                                     const std::vector<std::string>& options);

}  // namespace pmcd::sim
