// SPDX-License-Identifier: MIT
// Least completed first served: the client that has received least so far goes next. It looks at no sizes or speeds.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Fewest payload bytes acknowledged on the session's data channel, of all its meshes. [O(log n) an event]
/// Source: Globacnik, CESCG (LCFS).
std::unique_ptr<Rule> make_lcfs();

}  // namespace pmcd::scheduler
