// SPDX-License-Identifier: MIT
// Judges whether a client takes its data: told now and then how far it has acknowledged, it says when that has stood
// still for too long, or was too little for too long. Arithmetic on times and counts; no socket and no clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "daemon/scheduler/request.h"
#include "daemon/turns/limits.h"

namespace pmcd::turns {

using scheduler::Time;

class Pace {
 public:
  enum class Verdict : std::uint8_t { fine, stalled, too_slow };

  /// The client's turn begins, or goes on with another transfer.
  void begin(std::uint64_t acknowledged, Time now);
  [[nodiscard]] bool has_begun() const { return has_begun_; }

  /// `acknowledged`: position in the stream, never falling. `owes`: it has not acknowledged all that was sent.
  /// stalled: it owed all the time and acknowledged nothing for limits.stall. too_slow: over the last
  /// limits.rate_window of its turn it acknowledged less than limits.min_rate bytes a second. Its turn is the time in
  /// which it owes, without the first second of each transfer, which belongs to the round trip.
  Verdict note(std::uint64_t acknowledged, bool owes, Time now, const Limits& limits);

 private:
  static constexpr std::size_t kParts = 10;

  void count(std::uint64_t bytes, Time turn, Time part);
  [[nodiscard]] bool too_slow(const Limits& limits) const;

  std::uint64_t acknowledged_ = 0;
  bool owed_ = false;
  bool has_begun_ = false;
  Time noted_at_{0};
  Time progress_at_{0};
  Time turn_at_{0};  ///< when the turn begins to count

  std::array<std::uint64_t, kParts> bytes_{};  ///< of the last parts of the window, one after the other in a ring
  std::size_t parts_ = 0;                      ///< that are whole
  std::size_t part_ = 0;                       ///< that is being filled
  Time filled_{0};                             ///< of it
};

}  // namespace pmcd::turns
