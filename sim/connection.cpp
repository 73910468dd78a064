// SPDX-License-Identifier: MIT
#include "sim/connection.h"

#include <algorithm>
#include <cmath>

namespace pmcd::sim {
namespace {

constexpr double kLeastRetransmission = 0.2;
constexpr double kLeastWait = 0.002;  ///< that the kernel adds to its timers for probes and reordering
/// A socket's packets in its machine's own queue take no more memory than two like the next would: TSQ. Each takes so
/// much beside its bytes.
constexpr std::uint64_t kPacketMemory = 960;
constexpr std::uint64_t kSmallQueue = 2;
constexpr unsigned kDuplicates = 3;
constexpr double kSackBytes = 12;

}  // namespace

Connection::Connection(Timeline& timeline, Path& path, double window)
    : timeline_(&timeline), path_(&path), window_end_(static_cast<std::uint64_t>(window)), window_(window) {}

std::uint64_t Connection::sacked() const {
  std::uint64_t bytes = 0;
  for (const Segment& segment : flight_) bytes += segment.sacked ? segment.end - segment.begin : 0;
  return bytes;
}

void Connection::reset() {
  gone_ = true;
  on_data = nullptr;
  on_writable = nullptr;
}

std::uint64_t Connection::write(std::uint64_t bytes, std::uint64_t unsent_bound) {
  if (gone_) return bytes;
  const double now = timeline_->now();
  if (flight_.empty() && now - sent_at_ > timeout()) cubic_.idle(now - sent_at_, timeout());
  if (unsent() < kSegment && in_uplink_ == 0 && in_flight_ < cubic_.window() && lost_ == 0) {
    limited_until_ = std::max<std::uint64_t>(delivered_ + in_flight_, 1);
  }
  std::uint64_t taken = 0;
  while (taken < bytes) {
    const std::uint64_t tail = unsent() % kSegment;
    if (tail == 0 && unsent() >= unsent_bound) break;
    const std::uint64_t part = std::min(bytes - taken, kSegment - tail);
    written_ += part;
    taken += part;
    // A whole segment leaves while the rest is still being copied.
    if (part + tail == kSegment) push();
  }
  push();
  return taken;
}

void Connection::call_when_writable(std::uint64_t unsent_bound) {
  writable_bound_ = unsent_bound;
  if (2 * unsent() >= unsent_bound || !on_writable) return;
  writable_bound_ = 0;
  timeline_->at(timeline_->waking(timeline_->now()), [this] {
    if (on_writable) on_writable();
  });
}

bool Connection::may_send(std::uint64_t bytes) const {
  return in_uplink_ < kSmallQueue * (kPacketMemory + bytes) || flight_.size() <= 1;
}

void Connection::push() {
  if (gone_) return;
  bool limited = false;
  while (lost_ > 0 || sent_ < written_) {
    if (in_flight_ >= cubic_.window()) {
      limited = true;
      break;
    }
    if (lost_ > 0) {
      const auto segment = std::find_if(flight_.begin(), flight_.end(), [](const Segment& one) { return one.lost; });
      if (!may_send(segment->end - segment->begin)) break;
      segment->lost = false;
      --lost_;
      transmit(*segment);
      continue;
    }
    const std::uint64_t end = std::min(written_, sent_ + kSegment);
    if (end > window_end_ || !may_send(end - sent_)) break;
    Segment segment;
    segment.begin = sent_;
    segment.end = end;
    sent_ = end;
    flight_.push_back(segment);
    transmit(flight_.back());
  }
  note_window_use(limited);
  if (writable_bound_ > 0) call_when_writable(writable_bound_);
}

void Connection::note_window_use(bool limited) {
  if (acknowledged_ < use_end_ && !limited && flight_.size() <= most_in_flight_) return;
  is_limited_ = limited;
  most_in_flight_ = static_cast<unsigned>(flight_.size());
  use_end_ = sent_;
}

void Connection::transmit(Segment& segment) {
  const double now = timeline_->now();
  if (in_flight_ == 0 && sacked_ == 0) first_sent_at_ = delivered_at_ = now;
  segment.sent_at = sent_at_ = now;
  segment.order = ++order_;
  ++segment.transmissions;
  segment.delivered = delivered_;
  segment.delivered_at = delivered_at_;
  segment.first_sent_at = first_sent_at_;
  segment.limited = limited_until_ > 0;
  ++in_flight_;
  if (recovers_) ++sent_since_;
  const std::uint64_t begin = segment.begin;
  const std::uint64_t end = segment.end;
  const std::uint64_t memory = end - begin + kPacketMemory;
  const bool waits = path_->send_down(
      static_cast<double>(end - begin) + kHeadBytes,
      [this, memory] {
        in_uplink_ -= memory;
        push();
      },
      [this, begin, end] { comes(begin, end); });
  if (waits) in_uplink_ += memory;
  if (flight_.size() == 1 || timer_ == 0) set_timer();
}

void Connection::comes(std::uint64_t begin, std::uint64_t end) {
  if (gone_) return;
  if (end > received_) apart_[begin] = std::max(apart_[begin], end);
  while (!apart_.empty() && apart_.begin()->first <= received_) {
    received_ = std::max(received_, apart_.begin()->second);
    apart_.erase(apart_.begin());
  }
  if (reads_) read_ = received_;
  const auto window_end = read_ + static_cast<std::uint64_t>(window_);
  const double bytes = kHeadBytes + (apart_.empty() ? 0 : kSackBytes);
  path_->send_up(bytes, [this, up_to = received_, begin, window_end] { acknowledge(up_to, begin, window_end); });
  if (!reads_ || !on_data || received_ == told_) return;
  told_ = received_;
  timeline_->at(timeline_->waking(timeline_->now()), [this, position = received_] {
    if (reads_ && on_data) on_data(position);
  });
}

void Connection::acknowledge(std::uint64_t up_to, std::uint64_t begin, std::uint64_t window_end) {
  if (gone_) return;
  const double now = timeline_->now();
  acknowledged_at_ = now;
  window_end_ = std::max(window_end_, window_end);
  unsigned delivered = 0;
  std::optional<Segment> newest;
  double round_trip = -1;
  const auto deliver = [&](Segment& segment) {
    ++delivered;
    if (segment.lost) {
      --lost_;
    } else {
      --in_flight_;
    }
    if (segment.transmissions == 1) round_trip = now - segment.sent_at;
    if (!newest || segment.order > newest->order) newest = segment;
  };
  const bool advanced = up_to > acknowledged_;
  while (!flight_.empty() && flight_.front().end <= up_to) {
    if (flight_.front().sacked) {
      --sacked_;
    } else {
      deliver(flight_.front());
    }
    acknowledged_ = flight_.front().end;
    flight_.pop_front();
  }
  if (begin >= up_to) {
    const auto segment =
        std::find_if(flight_.begin(), flight_.end(), [begin](const Segment& one) { return one.begin == begin; });
    if (segment != flight_.end() && !segment->sacked) {
      deliver(*segment);
      segment->sacked = true;
      segment->lost = false;
      ++sacked_;
    }
  }
  if (delivered > 0) {
    delivered_ += delivered;
    delivered_at_ = now;
    if (limited_until_ > 0 && delivered_ > limited_until_) limited_until_ = 0;
    if (newest->order > newest_delivered_) {
      newest_delivered_ = newest->order;
      newest_round_trip_ = now - newest->sent_at;
    }
    backoff_ = 0;
    probed_ = false;
  }
  if (round_trip >= 0) {
    last_round_trip_ = round_trip;
    least_round_trip_ = std::min(least_round_trip_, round_trip);
    if (smoothed_ == 0) {
      smoothed_ = round_trip;
      deviation_ = round_trip / 2;
    } else {
      deviation_ += (std::abs(round_trip - smoothed_) - deviation_) / 4;
      smoothed_ += (round_trip - smoothed_) / 8;
    }
  }
  if (newest) note_rate(*newest);
  if (recovers_ && acknowledged_ >= recovery_end_) {
    recovers_ = false;
    cubic_.set_window(std::max(cubic_.threshold(), 1U));
  }
  const bool found_lost = find_lost();
  if (recovers_) {
    count_out(delivered, advanced && !found_lost ? 1 : 0);
  } else if (delivered > 0) {
    const bool round_is_over = acknowledged_ > round_end_;
    if (round_is_over) round_end_ = sent_;
    const bool used = is_limited_ || (cubic_.is_slow_start() && cubic_.window() < 2 * most_in_flight_);
    cubic_.acknowledged(delivered, round_trip >= 0 ? round_trip : last_round_trip_, round_is_over, used, now);
  }
  push();
  set_timer();
}

void Connection::note_rate(const Segment& newest) {
  const double now = timeline_->now();
  const double sending = newest.sent_at - newest.first_sent_at;
  const double interval = std::max(sending, now - newest.delivered_at);
  first_sent_at_ = newest.sent_at;
  const auto packets = static_cast<double>(delivered_ - newest.delivered);
  if (interval < least_round_trip_ || interval <= 0) return;
  const double rate = packets * kSegment / interval;
  if (newest.limited && rate < rate_) return;
  rate_ = rate;
  rate_is_limited_ = newest.limited;
}

bool Connection::find_lost() {
  const double now = timeline_->now();
  const bool at_once = recovers_ || sacked_ >= kDuplicates;
  const double reordering = at_once ? 0 : std::min(least_round_trip_ / 4, smoothed_);
  bool found = false;
  double last = 0;
  for (Segment& segment : flight_) {
    if (segment.sacked || segment.lost || segment.order >= newest_delivered_) continue;
    const double lost_at = segment.sent_at + newest_round_trip_ + reordering;
    if (!at_once && lost_at > now) {
      last = std::max(last, lost_at);
      continue;
    }
    segment.lost = true;
    ++lost_;
    --in_flight_;
    found = true;
  }
  if (found && !recovers_) begin_recovery(false);
  if (last > 0) {
    timeline_->at(last + kLeastWait, [this, newest = newest_delivered_] {
      if (gone_ || newest != newest_delivered_ || !find_lost()) return;
      count_out(0, 1);
      push();
    });
  }
  return found;
}

void Connection::begin_recovery(bool timed_out) {
  before_loss_ = cubic_.window();
  cubic_.lost(timed_out);
  recovers_ = true;
  recovery_end_ = sent_;
  delivered_since_ = sent_since_ = 0;
}

/// What may leave while losses are made good, in proportion to what comes through (RFC 6937).
void Connection::count_out(unsigned delivered, unsigned least) {
  delivered_since_ += delivered;
  const unsigned threshold = cubic_.threshold();
  unsigned may = 0;
  if (in_flight_ > threshold) {
    const unsigned due = (delivered_since_ * threshold + before_loss_ - 1) / before_loss_;
    may = due > sent_since_ ? due - sent_since_ : 0;
  } else {
    const unsigned owed = delivered_since_ > sent_since_ ? delivered_since_ - sent_since_ : 0;
    may = std::min(threshold - in_flight_, std::max(owed, delivered) + least);
  }
  if (sent_since_ == 0) may = std::max(may, 1U);
  cubic_.set_window(in_flight_ + may);
}

double Connection::timeout() const {
  if (smoothed_ == 0) return 1;
  return (smoothed_ + std::max(4 * deviation_, kLeastRetransmission)) * std::exp2(std::min(backoff_, 10U));
}

void Connection::set_timer() {
  if (flight_.empty()) {
    ++timer_;
    return;
  }
  double wait = timeout();
  probe_is_next_ = false;
  if (!recovers_ && !probed_ && backoff_ == 0 && smoothed_ > 0) {
    const double probe = 2 * smoothed_ + (flight_.size() == 1 ? kLeastRetransmission : kLeastWait);
    if (probe < wait) {
      wait = probe;
      probe_is_next_ = true;
    }
  }
  timeline_->at(timeline_->now() + wait, [this, timer = ++timer_] {
    if (timer == timer_ && !gone_) timer_is_over();
  });
}

void Connection::timer_is_over() {
  if (flight_.empty()) return;
  if (in_uplink_ > 0) {
    set_timer();
    return;
  }
  if (probe_is_next_) {
    probed_ = true;
    Segment& last = flight_.back();
    if (sent_ < written_ && std::min(written_, sent_ + kSegment) <= window_end_) {
      Segment segment;
      segment.begin = sent_;
      segment.end = std::min(written_, sent_ + kSegment);
      sent_ = segment.end;
      flight_.push_back(segment);
      transmit(flight_.back());
    } else if (!last.sacked) {
      if (last.lost) {
        last.lost = false;
        --lost_;
      } else {
        --in_flight_;
      }
      transmit(last);
    }
    set_timer();
    return;
  }
  for (Segment& segment : flight_) {
    if (segment.sacked || segment.lost) continue;
    segment.lost = true;
    ++lost_;
    --in_flight_;
  }
  if (lost_ == 0) return;
  if (!recovers_ || backoff_ == 0) begin_recovery(true);
  cubic_.set_window(1);
  ++backoff_;
  push();
  set_timer();
}

}  // namespace pmcd::sim
