// SPDX-License-Identifier: MIT
// First in, first out: so a packet's departure is known when it comes.
#include "sim/shaper.h"

#include <algorithm>

namespace pmcd::sim {
namespace {

constexpr double kLeastBurst = 1600;
constexpr double kBurstSeconds = 0.004;

}  // namespace

Shaper Shaper::of(double kbit, double limit) {
  return {kbit * 125, std::max(kLeastBurst, kbit * 125 * kBurstSeconds), limit};
}

std::optional<double> Shaper::pass(double bytes, double now) {
  while (!queue_.empty() && queue_.front().first <= now) {
    waiting_ -= queue_.front().second;
    queue_.pop_front();
  }
  if (queue_.empty()) waiting_ = 0;
  if (waiting_ + bytes > limit_) return std::nullopt;
  double departs = std::max(now, counted_until_);
  tokens_ = std::min(burst_, tokens_ + (departs - counted_until_) * rate_);
  if (tokens_ < bytes) {
    departs += (bytes - tokens_) / rate_;
    tokens_ = bytes;
  }
  tokens_ -= bytes;
  counted_until_ = departs;
  waiting_ += bytes;
  queue_.emplace_back(departs, bytes);
  return departs;
}

}  // namespace pmcd::sim
