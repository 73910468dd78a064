// SPDX-License-Identifier: MIT
// Policies as they are written on the simulator's command line, in the daemon's own names and with its own errors.
#pragma once

#include <string>
#include <vector>

#include "daemon/scheduler/policy.h"
#include "sim/problem.h"

namespace pmcd::sim {

/// One policy for each rule, in that order. `rules`: a rule's name, "NAME+OPTION=VALUE+..." with options that this rule
/// has and others have not, or "all" for every rule there is; blanks around it do not count. `options`: "NAME=VALUE";
/// one that only one rule has is for that rule and must have it among `rules`.
Result<std::vector<scheduler::Policy>> read_policies(const std::vector<std::string>& rules,
                                                     const std::vector<std::string>& options);

/// A policy's rule as read_policies() takes it, with the options that differ from their defaults: "gain+until=5".
std::string rule_text(const scheduler::Policy& policy);

}  // namespace pmcd::sim
