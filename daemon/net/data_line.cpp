// SPDX-License-Identifier: MIT
// Asks the kernel, seldom: each question is a system call, and many sessions may have something under way.
#include "daemon/net/data_line.h"

#include <algorithm>
#include <chrono>

#include "daemon/net/socket_state.h"
#include "daemon/net/tcp_info.h"

namespace pmcd::net {
namespace {

using std::chrono::milliseconds;

constexpr Duration kBetweenInfos = milliseconds(5);
/// A bound that is off by less is not told anew.
constexpr std::size_t kWorthTelling = 4;
constexpr double kMostBytes = 1e9;
constexpr scheduler::Time kAhead = milliseconds(250);

}  // namespace

scheduler::Time scheduler_time(Clock::time_point time) {
  return std::chrono::duration_cast<scheduler::Time>(time.time_since_epoch());
}

std::size_t enough_under_way(double rate, scheduler::Time round_trip, std::size_t first_chunk_bytes) {
  const double seconds = std::chrono::duration<double>(round_trip + kAhead).count();
  return std::max(2 * first_chunk_bytes, static_cast<std::size_t>(std::min(rate * seconds, kMostBytes)));
}

void DataLine::taken_back(std::size_t payload_bytes) {
  while (payload_bytes > 0 && !chunks_.empty()) {
    payload_bytes -= std::min(payload_bytes, chunks_.back().payload);
    chunks_.pop_back();
  }
}

DataLine::News DataLine::look(Clock::time_point now) {
  News news;
  news.sample.acknowledged = channel_.acknowledged_position();
  news.sample.owes = news.sample.acknowledged < channel_.queued_position();
  news.sample.now = scheduler_time(now);
  news.sample.round_trip = round_trip_;
  while (!chunks_.empty() && chunks_.front().end <= news.sample.acknowledged) {
    news.payload += chunks_.front().payload;
    chunks_.pop_front();
  }
  if (channel_.is_open() && now - info_at_ >= kBetweenInfos) {
    info_at_ = now;
    if (const auto info = tcp_info(channel_.native_handle())) {
      round_trip_ = info->least_round_trip;
      news.sample.round_trip = round_trip_;
      // What came behind a lost segment is with the client, but acknowledged only later, and then all at once.
      news.sample.acknowledged = std::min(news.sample.acknowledged + info->sacked_bytes, channel_.queued_position());
      if (!info->application_limited) news.sample.delivery_rate = info->delivery_rate;
      // The last acknowledgement may have come long before this look.
      if (!news.sample.owes) news.sample.now -= info->last_acknowledged;
    }
  }
  return news;
}

bool DataLine::sent() {
  return channel_.unwritten() == 0 && (!channel_.is_open() || unsent_bytes(channel_.native_handle()) == 0);
}

bool DataLine::has_enough(std::optional<double> guess) {
  return channel_.queued_position() - channel_.acknowledged_position() >=
         enough_under_way(guess.value_or(0), round_trip_, limits_.first_chunk_bytes);
}

std::size_t DataLine::chunk_bytes(std::optional<double> speed) {
  const double tenth = std::min(speed.value_or(0) / 10, kMostBytes);
  const std::size_t chunk =
      speed ? std::clamp(static_cast<std::size_t>(tenth), limits_.least_chunk_bytes, limits_.most_chunk_bytes)
            : limits_.first_chunk_bytes;
  const std::size_t bound = std::max(chunk, static_cast<std::size_t>(tenth));
  const std::size_t off = bound > unsent_bound_ ? bound - unsent_bound_ : unsent_bound_ - bound;
  if (unsent_bound_ == 0 || off > unsent_bound_ / kWorthTelling) {
    unsent_bound_ = bound;
    if (channel_.is_open()) bound_unsent(channel_.native_handle(), bound);
  }
  return chunk;
}

}  // namespace pmcd::net
