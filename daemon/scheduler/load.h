// SPDX-License-Identifier: MIT
// What the clients that are being served take of the uplink, or are about to. A sum that is kept: an event of a client
// touches that client's part alone, and all of it is reckoned anew only when a twentieth of a second has passed, from
// which on what they take at present is another. It decides nothing.
#pragma once

#include <cstdint>
#include <utility>

#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/request.h"
#include "daemon/scheduler/rule.h"
#include "daemon/scheduler/sorted_blocks.h"

namespace pmcd::scheduler {

/// REQUIRES of all functions with a `now`: it never falls.
class Load {
 public:
  /// REQUIRES: `surroundings` outlives it.
  explicit Load(const Surroundings& surroundings) : surroundings_(surroundings) {}

  /// A request is served since then, which may be past, or not since what was said before. [O(log n)]
  void served_since(RequestKey key, SessionKey session, Time since);
  /// It is served no longer. No effect if it is not known. [O(log n)]
  void ends(RequestKey key);
  void clear();
  /// Its client has been observed. No effect if it is not known. [O(1)]
  void observed(RequestKey key, Time now);

  /// Bytes a second. [O(1); O(n) when it is asked for the first time in a twentieth of a second, or the uplink has
  /// changed]
  [[nodiscard]] double sum(Time now);

 private:
  struct Served {
    SessionKey session = 0;
    Time since{0};
    double counted = 0;  ///< in the sum
  };

  [[nodiscard]] double expected(const Served& served, Time now) const;
  void count(Served& served, Time now);
  void count_all(Time now);

  const Surroundings& surroundings_;
  KeyMap<Served> served_;
  SortedBlocks<std::pair<Time, RequestKey>> young_;  ///< those whose taking shows nothing yet, by their beginnings
  double sum_ = 0;
  std::int64_t counted_part_ = -1;  ///< of time, as RecentRate cuts it, in which all were counted
  double counted_uplink_ = 0;
};

}  // namespace pmcd::scheduler
