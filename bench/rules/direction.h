// SPDX-License-Identifier: MIT
// One direction of the relay: which packets are lost, which find no room, and when the others leave. Arithmetic on
// times and bytes; it holds packets, and knows no device and no clock.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <vector>

namespace pmcd::bench {

using Clock = std::chrono::steady_clock;

struct DirectionOptions {
  std::chrono::nanoseconds delay{0};
  double loss = 0;              ///< probability, 0 to 1
  std::uint64_t seed = 1;       ///< the same seed loses the same packets
  std::size_t queue_bytes = 0;  ///< most bytes that wait for the rate; 0: any number. Packets under way do not wait.
  double bytes_per_second = 0;  ///< 0: no limit
};

struct DirectionCounts {
  std::uint64_t packets = 0;  ///< forwarded
  std::uint64_t bytes = 0;
  std::uint64_t lost = 0;     ///< by chance
  std::uint64_t crowded = 0;  ///< dropped because the queue was full
  std::uint64_t refused = 0;  ///< the device on the other side did not take it
};

class Direction {
 public:
  explicit Direction(const DirectionOptions& options) : options_(options), random_(options.seed) {}

  /// A packet that comes at `now`; `now` never falls from call to call.
  void arrive(std::vector<std::byte> packet, Clock::time_point now);

  /// When the next packet is due; none if none is held.
  [[nodiscard]] std::optional<Clock::time_point> due() const;

  /// The next packet, if it is due at `now`.
  std::optional<std::vector<std::byte>> depart(Clock::time_point now);

  void count_refused() { ++counts_.refused; }
  void count_forwarded(std::size_t bytes);
  [[nodiscard]] const DirectionCounts& counts() const { return counts_; }

 private:
  struct Held {
    Clock::time_point due;
    std::vector<std::byte> bytes;
  };

  DirectionOptions options_;
  std::mt19937_64 random_;
  DirectionCounts counts_;
  std::deque<Held> held_;           ///< ascending by due: delay and rate are the same for all
  Clock::time_point line_free_at_;  ///< when the line has sent all that it took
};

}  // namespace pmcd::bench
