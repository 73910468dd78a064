// SPDX-License-Identifier: MIT
// A count that begins anew each second.
#include "daemon/net/log_budget.h"

#include <spdlog/spdlog.h>

namespace pmcd::net {

bool LogBudget::take(Clock::time_point now) {
  if (now - second_ >= std::chrono::seconds(1)) {
    if (left_out_ > 0) spdlog::warn("{} lines about connections were left out: too many in a second", left_out_);
    left_out_ = 0;
    taken_ = 0;
    second_ = now;
  }
  if (taken_ == most_) {
    ++left_out_;
    return false;
  }
  ++taken_;
  return true;
}

}  // namespace pmcd::net
