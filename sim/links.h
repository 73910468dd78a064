// SPDX-License-Identifier: MIT
// The server's uplink as a fluid: each flow that has something to send gets its max-min share of it, and no more than
// its own line takes. It knows positions in byte streams and when they are reached; no packets, no windows, no delays.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sim/indexed_heap.h"

namespace pmcd::sim {

/// Times in seconds, rates in bytes a second. Flows that share move together, so that one counter serves them all and
/// only those are touched that pass between sharing and being held by their cap.
class Uplink {
 public:
  using Flow = IndexedHeap::Id;
  struct Reached {
    double at = 0;
    Flow flow = 0;
  };

  /// REQUIRES: capacity > 0.
  explicit Uplink(double capacity) : capacity_(capacity) {}

  /// A flow that stands at position 0 and does not move; they are numbered from 0.
  Flow add();

  /// What its line takes at most from now on. REQUIRES: cap > 0. [O(log n), and O(log n) for each flow that passes]
  void set_cap(Flow flow, double cap);
  /// The flow moves from now on; the time at which it is at `target` is told by next(). REQUIRES: target is beyond its
  /// position, and cap was set. [as set_cap; O(log n) if it moves already]
  void move_to(Flow flow, double target);
  /// It stops where it is. No effect if it does not move.
  void stop(Flow flow);

  /// The first of all flows to reach its target if nothing changes; none if nothing moves. [O(1)]
  [[nodiscard]] std::optional<Reached> next() const;
  /// Time passes. REQUIRES: now does not fall and is not beyond next().
  void advance(double now);
  /// Time passes until next(), and that flow stands exactly at its target. It goes on moving, and needs a new target,
  /// or to be stopped, before time passes again. REQUIRES: something moves.
  Flow take_next();

  [[nodiscard]] double position(Flow flow) const;
  [[nodiscard]] bool moves(Flow flow) const { return flows_[flow].state != State::still; }
  /// Bytes a second at present, 0 for one that does not move.
  [[nodiscard]] double rate(Flow flow) const;
  /// Whether its own cap, not the uplink, holds it.
  [[nodiscard]] bool is_capped(Flow flow) const { return flows_[flow].state == State::capped; }
  [[nodiscard]] double capacity() const { return capacity_; }

 private:
  enum class State : std::uint8_t { still, capped, sharing };
  struct Body {
    State state = State::still;
    bool timed = false;  ///< has a target that is still to be reached
    double cap = 0;
    double target = 0;  ///< of one that does not move: its position
    double tag = 0;     ///< capped: when it is at its target; sharing: what `served_` is then
  };

  void enter(Flow flow, State state, double remaining);
  void leave(Flow flow);
  [[nodiscard]] double remaining(const Body& body) const;
  [[nodiscard]] double share_of_all() const;
  void level();
  IndexedHeap& tags(State state) { return state == State::capped ? capped_tags_ : sharing_tags_; }

  double capacity_;
  double now_ = 0;
  double served_ = 0;  ///< bytes that a flow would have got that shares since the beginning
  double share_ = 0;
  double capped_sum_ = 0;
  std::vector<Body> flows_;
  IndexedHeap capped_tags_, sharing_tags_;
  IndexedHeap capped_caps_;   ///< the largest first, so their keys are negative
  IndexedHeap sharing_caps_;  ///< the least first
};

}  // namespace pmcd::sim
