// SPDX-License-Identifier: MIT
// How fast a client takes what it is sent: from what it has acknowledged while it owed an acknowledgement, and from
// what its TCP says. Arithmetic on times and counts, the same in the daemon and in the simulator; no socket, no clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

/// What is known of a client's data channel at a moment.
struct SpeedSample {
  Time now{0};
  std::uint64_t acknowledged = 0;  ///< position in the stream, never falling
  bool owes = false;               ///< it has not acknowledged all that was written
  double delivery_rate = 0;        ///< bytes a second as the kernel measured it while data was there to send; 0: none
  Time round_trip{0};              ///< the least that was seen; 0: not known
};

class SpeedMeter {
 public:
  /// REQUIRES: samples come in the order of their times. To be called when sending begins (owes, nothing of it
  /// acknowledged yet) and then now and then while the client owes: the more often, the finer. [O(1)]
  void note(const SpeedSample& sample);

  /// Bytes a second; none until kFirstBytes were acknowledged or kFirstTime of sending is over. At least 1. What
  /// happened while nothing was on its way to the client does not count, nor does the first round trip of each
  /// stretch of sending. Where sending is often shared or interrupted, the fastest of the last parts is what the line
  /// can do.
  [[nodiscard]] std::optional<double> speed() const;
  /// The same from the first acknowledgement on: a guess that may be far off.
  [[nodiscard]] std::optional<double> guess() const;

  static constexpr std::uint64_t kFirstBytes = 32'000;
  static constexpr Time kFirstTime = std::chrono::seconds(2);

 private:
  static constexpr std::size_t kParts = 4;
  static constexpr std::size_t kRates = 5;

  void count(std::uint64_t bytes, Time time);
  void close_part();
  [[nodiscard]] double part_rate() const;

  bool owed_ = false;
  std::uint64_t acknowledged_ = 0;
  Time counted_until_{0};  ///< of a stretch: when counting goes on, a round trip after its begin at first

  std::uint64_t bytes_ = 0;  ///< counted in all
  Time time_{0};
  std::uint64_t part_bytes_ = 0;  ///< in the part that is being filled, until its last acknowledgement
  Time part_time_{0};
  Time silent_{0};                      ///< since then
  bool stalled_ = false;                ///< the last part ended in silence, and none has broken it
  std::array<double, kParts> parts_{};  ///< rates of the last whole parts, in a ring
  std::size_t whole_ = 0;
  std::array<double, kRates> rates_{};  ///< of the kernel, since the part began, in a ring
  std::size_t rates_seen_ = 0;
};

}  // namespace pmcd::scheduler
