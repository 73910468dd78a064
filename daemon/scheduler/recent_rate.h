// SPDX-License-Identifier: MIT
// Bytes a second over the last half second, from counts as they come. It keeps eleven numbers and no history.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

class RecentRate {
 public:
  static constexpr Time kSpan = std::chrono::milliseconds(500);
  static constexpr Time kPart = std::chrono::milliseconds(50);

  /// REQUIRES: times do not fall. [O(1)]
  void note(std::uint64_t bytes, Time now) {
    move_to(now);
    parts_[static_cast<std::size_t>(part_) % kParts] += bytes;
  }
  /// Over the last half second that is whole: what came in the last twentieth of a second may not count yet. Without
  /// note() it changes only at multiples of kPart.
  [[nodiscard]] double rate(Time now) const {
    RecentRate moved = *this;
    moved.move_to(now);
    std::uint64_t bytes = 0;
    for (const std::uint64_t part : moved.parts_) bytes += part;
    bytes -= moved.parts_[static_cast<std::size_t>(moved.part_) % kParts];
    return static_cast<double>(bytes) / std::chrono::duration<double>(kSpan).count();
  }

 private:
  static constexpr std::size_t kParts = kSpan / kPart + 1;  ///< the last of them is being filled

  void move_to(Time now) {
    const std::int64_t part = now / kPart;
    for (std::size_t cleared = 0; part_ < part && cleared < kParts; ++cleared) {
      parts_[static_cast<std::size_t>(++part_) % kParts] = 0;
    }
    if (part_ < part) part_ = part;
  }

  std::array<std::uint64_t, kParts> parts_{};
  std::int64_t part_ = 0;  ///< number of the part that is being filled, counted from the start of time
};

}  // namespace pmcd::scheduler
