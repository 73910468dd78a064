// SPDX-License-Identifier: MIT
// A token bucket with a queue, as Linux' tbf: what may pass at once, and when the rest has passed. Arithmetic on bytes
// and times; it holds no packets.
#pragma once

#include <deque>
#include <optional>
#include <utility>

namespace pmcd::sim {

class Shaper {
 public:
  /// `burst`: bytes that may pass at once after a pause; `limit`: that may wait. REQUIRES: rate > 0, burst at least the
  /// largest packet.
  Shaper(double rate, double burst, double limit) : rate_(rate), burst_(burst), limit_(limit), tokens_(burst) {}
  /// One as bench/rules makes them: a burst of a packet, or of what the rate brings in 4 ms.
  static Shaper of(double kbit, double limit);

  /// When a packet that comes now has passed; none if it finds no room and is dropped. REQUIRES: now does not fall.
  std::optional<double> pass(double bytes, double now);

 private:
  double rate_, burst_, limit_;
  double tokens_;
  double counted_until_ = 0;  ///< at the departure of the last packet
  double waiting_ = 0;
  std::deque<std::pair<double, double>> queue_;  ///< departure, bytes
};

}  // namespace pmcd::sim
