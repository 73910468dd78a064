// SPDX-License-Identifier: MIT
// Equal shares in bytes: clients take turns, and each turn brings credit for as many bytes as the client's weight says.
// It looks at neither speed nor content.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Deficit round robin over bytes: a session gets kFairCredit bytes x weight a round and goes when its credit covers
/// what is left of its first request; what an interrupted turn did not send is given back. Rounds in which it asks for
/// nothing bring none, but what was left before is kept, unlike in the source: clients ask for one packet at a time,
/// and what is left of a round would be lost with each. Rounds are counted, not walked. [O(log n) an event]
/// Source: M. Shreedhar and G. Varghese, Efficient fair queueing using deficit round robin, SIGCOMM 1995.
std::unique_ptr<Rule> make_fair();

inline constexpr double kFairCredit = 1'500;

}  // namespace pmcd::scheduler
