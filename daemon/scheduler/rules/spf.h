// SPDX-License-Identifier: MIT
// Smallest packet first: the request for the smallest packet goes next, whoever asks. It looks at no client.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Smallest stored size of the packet, the whole of it also when a part is sent. [O(log n) an event]
/// Source: Globacnik, CESCG (SPF).
std::unique_ptr<Rule> make_spf();

}  // namespace pmcd::scheduler
