// SPDX-License-Identifier: MIT
// What is to be done later, in the order of time: the clock of the network of packets. It knows nobody.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include "sim/random.h"

namespace pmcd::sim {

class Timeline {
 public:
  using Step = std::function<void()>;

  /// `lateness`: seconds that a process wakes up late on average, drawn from the seed.
  explicit Timeline(double lateness = 0, std::uint64_t seed = 1) : lateness_(lateness), random_(seed) {}

  /// Seconds.
  [[nodiscard]] double now() const { return now_; }
  /// Steps of one moment are done in the order in which they were told. A moment that is over counts as now.
  void at(double when, Step step) { steps_.push({std::max(when, now_), next_++, std::move(step)}); }
  void soon(Step step) { at(now_, std::move(step)); }
  /// When a process does what it wakes up for at `when`: a little later, each time anew.
  double waking(double when) { return lateness_ > 0 ? when + 2 * lateness_ * random_.uniform() : when; }

  /// Does the next step; false if there is none.
  bool go_on() {
    if (steps_.empty()) return false;
    now_ = steps_.top().at;
    const Step step = steps_.top().step;
    steps_.pop();
    step();
    return true;
  }
  /// Steps that were told so far.
  [[nodiscard]] std::uint64_t count() const { return next_; }

 private:
  struct Entry {
    double at = 0;
    std::uint64_t number = 0;
    Step step;
  };
  struct Later {
    bool operator()(const Entry& a, const Entry& b) const { return a.at != b.at ? a.at > b.at : a.number > b.number; }
  };

  double lateness_;
  Random random_;
  double now_ = 0;
  std::uint64_t next_ = 0;
  std::priority_queue<Entry, std::vector<Entry>, Later> steps_;
};

}  // namespace pmcd::sim
