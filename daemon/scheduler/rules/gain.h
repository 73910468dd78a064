// SPDX-License-Identifier: MIT
// Steepest fall of visible error per byte: the packet that makes most meshes look better soonest goes next.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Base packets of all clients first, smallest first, for before them a client sees nothing. Then the largest index:
/// the steepest ratio of gain (see MeshProfile) to bytes over the next packets of the client's mesh, times min(1, speed
/// / uplink), for a slow client holds a slot longer for the same bytes. A client not yet measured counts as fast. With
/// `until_percent` P (0: none), a client whose mesh has come down to P percent of its first level's error is good
/// enough: it goes behind all that have not, and among its like the one goes first that can have the rest of its mesh
/// soonest, which is reckoned with the same min(1, speed / uplink), from 0.4 on with 1: two that share the uplink show
/// half of it each, and could have all. [O(log n) an event, and O(packets of the mesh) for each waiting request that
/// joins the queue or whose client acknowledges something]
/// Source: ours. W. E. Smith, Various optimizers for single-stage production (1956), shows that weight over time is the
/// order of least weighted completion; the upper hull over the coming packets is that ratio where a small packet of
/// little worth stands before one of much.
std::unique_ptr<Rule> make_gain(unsigned until_percent, const Surroundings& surroundings);

}  // namespace pmcd::scheduler
