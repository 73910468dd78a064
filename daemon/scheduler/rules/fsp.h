// SPDX-License-Identifier: MIT
// Fair sojourn protocol: jobs go one after the other in the order in which equal sharing would finish them, so that
// nobody waits longer than under equal sharing and most wait much less.
#pragma once

#include <memory>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// A job is one mesh of one session, its size what is left of the mesh when its first request joins the queue, and when
/// its base packet is asked for anew. It is served on paper by a VirtualServer of the uplink's capacity, at most at its
/// client's speed (not yet measured: without a limit). What that has finished goes first, in its order; then what it
/// will finish first. While the uplink is not known, the fastest guess is the median of measured speeds, or 100 kB/s.
/// [O(log n) a choice; an event may move jobs that reach or leave the limit of their speed, O(log n) each]
/// Source: E. Friedman and S. Henderson, Fairness and efficiency in web server protocols, SIGMETRICS 2003.
std::unique_ptr<Rule> make_fsp(const Surroundings& surroundings);

}  // namespace pmcd::scheduler
