// SPDX-License-Identifier: MIT
// A shaped line in virtual time, and a client behind it that acknowledges every second segment and the last one: what
// a meter of speeds sees of it. It models no losses and no slow start.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>

#include "daemon/scheduler/speed_meter.h"

namespace pmcd::scheduler {

class Line {
 public:
  Line(double bytes_a_second, Time round_trip, Time poll)
      : rate_(bytes_a_second), round_trip_(round_trip), poll_(poll) {}

  /// Hands over a packet and polls until all of it is acknowledged.
  void send(SpeedMeter& meter, std::uint64_t bytes) {
    begin(meter, bytes);
    while (acknowledged_ < written_) poll(meter);
  }
  /// The first half of send().
  void begin(SpeedMeter& meter, std::uint64_t bytes) {
    free_at_ = std::max(free_at_, now);
    const std::uint64_t end = written_ + bytes;
    for (bool second = false; written_ < end; second = !second) {
      const std::uint64_t segment = std::min<std::uint64_t>(kSegment, end - written_);
      free_at_ += std::chrono::duration_cast<Time>(std::chrono::duration<double>(static_cast<double>(segment) / rate_));
      written_ += segment;
      if (second || written_ == end) coming_.push_back({free_at_ + round_trip_, written_});
    }
    meter.note(sample());
  }
  void poll(SpeedMeter& meter) {
    now += poll_;
    for (; !stalled && !coming_.empty() && coming_.front().when <= now; coming_.pop_front()) {
      acknowledged_ = coming_.front().position;
    }
    meter.note(sample());
  }
  void set_rate(double bytes_a_second) { rate_ = bytes_a_second; }
  [[nodiscard]] std::uint64_t acknowledged() const { return acknowledged_; }
  [[nodiscard]] std::uint64_t owed() const { return written_ - acknowledged_; }

  Time now{0};
  bool stalled = false;

 private:
  static constexpr std::uint64_t kSegment = 1'448;
  struct Acknowledgement {
    Time when{0};
    std::uint64_t position = 0;
  };
  [[nodiscard]] SpeedSample sample() const { return {now, acknowledged_, acknowledged_ < written_, 0, round_trip_}; }

  double rate_;
  Time round_trip_;
  Time poll_;
  Time free_at_{0};
  std::uint64_t written_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::deque<Acknowledgement> coming_;
};

}  // namespace pmcd::scheduler
