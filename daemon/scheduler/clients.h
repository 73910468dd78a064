// SPDX-License-Identifier: MIT
// What a rule knows of a client, in one place: its speed, what it has acknowledged, its weight, and how it compares
// with the others. Told by whoever drives the scheduler. It knows no requests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/recent_rate.h"
#include "daemon/scheduler/request.h"
#include "daemon/scheduler/sorted_blocks.h"
#include "daemon/scheduler/speed_meter.h"

namespace pmcd::scheduler {

struct Client {
  SessionKey session = 0;
  std::optional<double> speed;     ///< bytes a second, at least 1; none: not measured yet
  std::uint64_t acknowledged = 0;  ///< payload bytes, of all its meshes
  double weight = 1;               ///< of its share, more than 0
};

/// The middle one of a set of numbers that come and go. [O(log n) each, the median O(1)]
class RunningMedian {
 public:
  void insert(double value);
  /// REQUIRES: it was inserted.
  void erase(double value);
  /// Of an even number the lower one; none of none.
  [[nodiscard]] std::optional<double> median() const;

 private:
  void balance();
  SortedBlocks<double> low_;  ///< as many as, or one more than, the high ones
  SortedBlocks<double> high_;
};

class Clients {
 public:
  /// The client of that session, which is made if it is not known. Stays where it is until forget().
  const Client& of(SessionKey session) { return record(session).client; }
  [[nodiscard]] const Client* find(SessionKey session) const;
  void forget(SessionKey session);
  [[nodiscard]] std::size_t size() const { return records_.size(); }

  /// Each answers whether the client's values have changed so that the order of its requests may.
  bool observe(SessionKey session, const SpeedSample& sample);
  bool acknowledged(SessionKey session, std::uint64_t payload_bytes);
  bool set_weight(SessionKey session, double weight);

  /// The client has a request that waits or runs, or has none any more.
  void set_active(SessionKey session, bool active);

  /// What the client is taking at present, for how long it has been observed while it owed, and what is guessed of its
  /// speed before it is measured.
  [[nodiscard]] double taking(SessionKey session, Time now) const;
  /// What all clients together are taking at present, bytes a second.
  [[nodiscard]] double taking(Time now) const { return rate_.rate(now); }
  [[nodiscard]] std::optional<double> guessed_speed(SessionKey session) const;

  /// Median of the measured speeds: of all clients, and of those that are active. [O(1), but O(n log n) for the first
  /// time, because no client's event is to cost what no rule has asked for]
  [[nodiscard]] std::optional<double> median_speed() const;
  [[nodiscard]] std::optional<double> median_active_speed() const;

 private:
  struct Record {
    Client client;
    SpeedMeter meter;
    RecentRate rate;
    std::uint64_t position = 0;
    bool active = false;
  };
  Record& record(SessionKey session);
  void count(const Record& record);
  void discount(const Record& record);

  [[nodiscard]] const Record* find_record(SessionKey session) const;

  KeyMap<std::unique_ptr<Record>> records_;
  RecentRate rate_;                           ///< of all together
  mutable std::optional<RunningMedian> all_;  ///< each is kept from the first time on that it is asked for
  mutable std::optional<RunningMedian> active_;
};

}  // namespace pmcd::scheduler
