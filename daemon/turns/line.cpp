// SPDX-License-Identifier: MIT
// Asks the kernel, seldom: each question is a system call, and many sessions may have something under way.
#include "daemon/turns/line.h"

#include <algorithm>
#include <chrono>

namespace pmcd::turns {
namespace {

using std::chrono::milliseconds;

constexpr Time kBetweenStates = milliseconds(5);
/// A bound that is off by less is not told anew.
constexpr std::size_t kWorthTelling = 4;
constexpr double kMostBytes = 1e9;
constexpr Time kAhead = milliseconds(250);

}  // namespace

std::size_t enough_under_way(double rate, Time round_trip, std::size_t first_chunk_bytes) {
  const double seconds = std::chrono::duration<double>(round_trip + kAhead).count();
  return std::max(2 * first_chunk_bytes, static_cast<std::size_t>(std::min(rate * seconds, kMostBytes)));
}

ChunkSize chunk_size(std::optional<double> speed, const Limits& limits) {
  if (!speed) return {limits.first_chunk_bytes, limits.first_chunk_bytes};
  const auto part = static_cast<std::size_t>(std::min(*speed * limits.chunk_seconds, kMostBytes));
  const std::size_t chunk = std::clamp(part, limits.least_chunk_bytes, limits.most_chunk_bytes);
  return {chunk, std::max(chunk, part)};
}

void Line::taken_back(std::size_t payload_bytes) {
  while (payload_bytes > 0 && !chunks_.empty()) {
    payload_bytes -= std::min(payload_bytes, chunks_.back().payload);
    chunks_.pop_back();
  }
}

Line::News Line::look(Time now) {
  News news;
  scheduler::SpeedSample& sample = news.sample;
  sample.acknowledged = stream_->acknowledged_position();
  sample.owes = sample.acknowledged < stream_->queued_position();
  sample.now = now;
  while (!chunks_.empty() && chunks_.front().end <= sample.acknowledged) {
    news.payload += chunks_.front().payload;
    chunks_.pop_front();
  }
  if (!asked_kernel_at_ || now - *asked_kernel_at_ >= kBetweenStates) {
    asked_kernel_at_ = now;
    if (const auto state = stream_->tcp_state()) {
      round_trip_ = state->least_round_trip;
      // What came behind a lost segment is with the client, but acknowledged only later, and then all at once.
      sample.acknowledged = std::min(sample.acknowledged + state->sacked_bytes, stream_->queued_position());
      if (!state->application_limited) sample.delivery_rate = state->delivery_rate;
      // The last acknowledgement may have come long before this look.
      if (!sample.owes) sample.now -= state->last_acknowledged;
    }
  }
  sample.round_trip = round_trip_;
  return news;
}

bool Line::has_enough(std::optional<double> guess) {
  return stream_->queued_position() - stream_->acknowledged_position() >=
         enough_under_way(guess.value_or(0), round_trip_, limits_.first_chunk_bytes);
}

std::size_t Line::chunk_bytes(std::optional<double> speed) {
  const auto [chunk, bound] = chunk_size(speed, limits_);
  const std::size_t off = bound > unsent_bound_ ? bound - unsent_bound_ : unsent_bound_ - bound;
  if (unsent_bound_ == 0 || off > unsent_bound_ / kWorthTelling) {
    unsent_bound_ = bound;
    stream_->bound_unsent(bound);
  }
  return chunk;
}

}  // namespace pmcd::turns
