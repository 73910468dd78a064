// SPDX-License-Identifier: MIT
// First in, first out: the request that has stood in the queue longest goes next. It looks at nothing else.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Oldest queued_at first, ties by session. [O(log n) an event]
/// Source: Globacnik, CESCG (FIFO).
std::unique_ptr<Rule> make_fifo();

}  // namespace pmcd::scheduler
