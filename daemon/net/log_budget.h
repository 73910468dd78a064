// SPDX-License-Identifier: MIT
// How many log lines a second strangers may cause by connecting and leaving, so that nobody fills a disk with them. It
// counts; whoever logs asks first. What was left out is told as a number.
#pragma once

#include <cstdint>

#include "daemon/net/asio.h"

namespace pmcd::net {

class LogBudget {
 public:
  explicit LogBudget(std::uint32_t lines_a_second = 200) : most_(lines_a_second) {}

  /// Whether one more line may be written now. Says, once a second at most, how many were not.
  bool take(Clock::time_point now = Clock::now());

 private:
  std::uint32_t most_;
  std::uint32_t taken_ = 0;
  std::uint64_t left_out_ = 0;
  Clock::time_point second_;  ///< when the second that is counted began
};

}  // namespace pmcd::net
