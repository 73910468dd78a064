// SPDX-License-Identifier: MIT
// Steepest fall of visible error per byte: the packet that makes most meshes look better soonest goes next.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// Base packets of all clients first, smallest first, for before them a client sees nothing. Then the largest index:
/// the steepest ratio of gain (see MeshProfile) to bytes over the next packets of the client's mesh, times
/// min(1, speed / uplink), for a slow client holds a slot longer for the same bytes. A client not yet measured counts
/// as fast. [O(log n) an event, O(packets of the mesh) when a request joins the queue]
/// Source: ours. W. E. Smith, Various optimizers for single-stage production (1956), shows that weight over time is the
/// order of least weighted completion; the upper hull over the coming packets is that ratio where a small packet of
/// little worth stands before one of much.
std::unique_ptr<Rule> make_gain(const Surroundings& surroundings);

}  // namespace pmcd::scheduler
