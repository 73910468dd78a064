// SPDX-License-Identifier: MIT
// Sending is cut into parts that are long enough not to be at the mercy of a single segment, and that end when an
// acknowledgement comes: a slow line's come in bursts that lie far apart, and a part that ended between two of them
// would be wrong by one. The speed is the fastest of the last few.
#include "daemon/scheduler/speed_meter.h"

#include <algorithm>

namespace pmcd::scheduler {
namespace {

using std::chrono::milliseconds;

/// A part ends when both are reached, or the long time; or if nothing was acknowledged for so long, and from then on
/// again each time the long time is over.
constexpr std::uint64_t kPartBytes = 12'000;
constexpr Time kPartTime = milliseconds(100);
constexpr Time kLongPart = milliseconds(1000);
constexpr Time kSilence = milliseconds(2000);

double rate(std::uint64_t bytes, Time time) {
  return static_cast<double>(bytes) / std::max(std::chrono::duration<double>(time).count(), 1e-6);
}

}  // namespace

void SpeedMeter::note(const SpeedSample& sample) {
  const std::uint64_t bytes = sample.acknowledged - std::min(acknowledged_, sample.acknowledged);
  acknowledged_ = std::max(acknowledged_, sample.acknowledged);
  if (!owed_) {
    counted_until_ = sample.now + sample.round_trip;
  } else {
    const Time time = std::max(sample.now - counted_until_, Time{0});
    counted_until_ = std::max(counted_until_, sample.now);
    if (sample.delivery_rate > 0) rates_[rates_seen_++ % kRates] = sample.delivery_rate;
    count(bytes, time);
  }
  owed_ = sample.owes;
}

void SpeedMeter::count(std::uint64_t bytes, Time time) {
  bytes_ += bytes;
  time_ += time;
  silent_ += time;
  const bool silence = bytes == 0 && silent_ >= (stalled_ ? kLongPart : kSilence);
  if (bytes == 0 && !silence) return;
  part_bytes_ += bytes;
  part_time_ += silent_;
  silent_ = Time{0};
  stalled_ = silence;
  if (silence || (part_bytes_ >= kPartBytes && part_time_ >= kPartTime) || part_time_ >= kLongPart) close_part();
}

void SpeedMeter::close_part() {
  parts_[whole_++ % kParts] = part_rate();
  part_bytes_ = 0;
  part_time_ = Time{0};
  rates_seen_ = 0;
}

double SpeedMeter::part_rate() const {
  const double own = rate(part_bytes_, part_time_);
  const std::size_t count = std::min(rates_seen_, kRates);
  if (count < kRates) return own;
  // The kernel's rates are of single round trips, each of them easily off; the one in the middle is not.
  auto sorted = rates_;
  std::nth_element(sorted.begin(), sorted.begin() + kRates / 2, sorted.end());
  return std::max(own, sorted[kRates / 2]);
}

std::optional<double> SpeedMeter::speed() const {
  if (bytes_ < kFirstBytes && time_ < kFirstTime) return std::nullopt;
  return guess();
}

std::optional<double> SpeedMeter::guess() const {
  if (whole_ > 0) {
    return std::max(
        1.0, *std::max_element(parts_.begin(), parts_.begin() + static_cast<std::ptrdiff_t>(std::min(whole_, kParts))));
  }
  if (part_bytes_ == 0) return std::nullopt;
  return std::max(1.0, part_rate());
}

}  // namespace pmcd::scheduler
