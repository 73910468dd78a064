// SPDX-License-Identifier: MIT
// What the uplink carries when it is busy: the most that all clients together have acknowledged in a second, of the
// last seconds in which they did. A lower bound of its capacity, and as good as the capacity once it was full. It knows
// no clients and no slots.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

class UplinkMeter {
 public:
  /// REQUIRES: times do not fall. [O(1)]
  void note(std::uint64_t bytes, Time now) {
    const std::int64_t second = std::chrono::floor<std::chrono::seconds>(now).count();
    if (second != second_) {
      if (bytes_ > 0) seconds_[whole_++ % kSeconds] = bytes_;
      bytes_ = 0;
      second_ = second;
    }
    bytes_ += bytes;
  }

  /// Bytes a second; none before the first whole second.
  [[nodiscard]] std::optional<double> capacity() const {
    if (whole_ == 0) return std::nullopt;
    const auto end = seconds_.begin() + static_cast<std::ptrdiff_t>(std::min(whole_, kSeconds));
    return static_cast<double>(*std::max_element(seconds_.begin(), end));
  }

 private:
  static constexpr std::size_t kSeconds = 30;

  std::int64_t second_ = 0;  ///< that is being counted
  std::uint64_t bytes_ = 0;
  std::array<std::uint64_t, kSeconds> seconds_{};  ///< the last busy ones, in a ring
  std::size_t whole_ = 0;
};

}  // namespace pmcd::scheduler
