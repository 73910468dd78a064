// SPDX-License-Identifier: MIT
// The rate is judged over a window that slides in tenths of its length, so a client needs ten numbers and no history.
#include "daemon/turns/pace.h"

#include <algorithm>
#include <chrono>
#include <numeric>

namespace pmcd::turns {
namespace {

constexpr Time kRoundTrip = std::chrono::seconds(1);

}  // namespace

void Pace::begin(std::uint64_t acknowledged, Time now) {
  has_begun_ = true;
  acknowledged_ = acknowledged;
  owed_ = false;
  noted_at_ = now;
  progress_at_ = now;
  turn_at_ = now + kRoundTrip;
}

Pace::Verdict Pace::note(std::uint64_t acknowledged, bool owes, Time now, const Limits& limits) {
  const std::uint64_t bytes = acknowledged - acknowledged_;
  const Time turn = owes && owed_ ? now - std::clamp(turn_at_, noted_at_, now) : Time::zero();
  acknowledged_ = acknowledged;
  owed_ = owes;
  noted_at_ = now;
  if (bytes > 0 || !owes) progress_at_ = now;
  if (now - progress_at_ >= limits.stall) return Verdict::stalled;
  if (limits.min_rate == 0) return Verdict::fine;
  count(bytes, turn, Time(limits.rate_window) / kParts);
  return too_slow(limits) ? Verdict::too_slow : Verdict::fine;
}

void Pace::count(std::uint64_t bytes, Time turn, Time part) {
  bytes_[part_] += bytes;
  filled_ += turn;
  while (filled_ >= part) {
    filled_ -= part;
    parts_ = std::min(parts_ + 1, kParts);
    part_ = (part_ + 1) % kParts;
    bytes_[part_] = 0;
  }
}

bool Pace::too_slow(const Limits& limits) const {
  if (parts_ < kParts) return false;
  // The part that is being filled replaced the oldest of the window: what is left is nine whole parts and this one.
  const std::uint64_t bytes = std::accumulate(bytes_.begin(), bytes_.end(), std::uint64_t{0});
  const double seconds = std::chrono::duration<double>(limits.rate_window).count();
  const double share = static_cast<double>(kParts - 1) / static_cast<double>(kParts);
  return static_cast<double>(bytes) < static_cast<double>(limits.min_rate) * seconds * share;
}

}  // namespace pmcd::turns
