// SPDX-License-Identifier: MIT
#include "bench/rules/direction.h"

#include <algorithm>
#include <utility>

namespace pmcd::bench {

void Direction::arrive(std::vector<std::byte> packet, Clock::time_point now) {
  if (std::uniform_real_distribution<double>()(random_) < options_.loss) {
    ++counts_.lost;
    return;
  }
  Clock::time_point sent_at = now;
  if (options_.bytes_per_second > 0) {
    const auto duration = [this](std::size_t bytes) {
      return std::chrono::duration_cast<Clock::duration>(
          std::chrono::duration<double>(static_cast<double>(bytes) / options_.bytes_per_second));
    };
    // What waits is what the line needs longer for than now.
    if (options_.queue_bytes > 0 && line_free_at_ > now &&
        line_free_at_ - now + duration(packet.size()) > duration(options_.queue_bytes)) {
      ++counts_.crowded;
      return;
    }
    line_free_at_ = std::max(line_free_at_, now) + duration(packet.size());
    sent_at = line_free_at_;
  }
  held_.push_back({sent_at + options_.delay, std::move(packet)});
}

std::optional<Clock::time_point> Direction::due() const {
  if (held_.empty()) return std::nullopt;
  return held_.front().due;
}

std::optional<std::vector<std::byte>> Direction::depart(Clock::time_point now) {
  if (held_.empty() || held_.front().due > now) return std::nullopt;
  std::vector<std::byte> packet = std::move(held_.front().bytes);
  held_.pop_front();
  return packet;
}

void Direction::count_forwarded(std::size_t bytes) {
  ++counts_.packets;
  counts_.bytes += bytes;
}

}  // namespace pmcd::bench
