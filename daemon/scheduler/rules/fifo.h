// SPDX-License-Identifier: MIT
// First in, first out: the request that has stood in the queue longest goes next. It looks at nothing else.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// A FIFO rule: oldest queued_at first, ties by session. Each event and each choice: O(log n) or better.
std::unique_ptr<Rule> make_fifo();

}  // namespace pmcd::scheduler
