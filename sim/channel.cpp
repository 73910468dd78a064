// SPDX-License-Identifier: MIT
// The fluid's positions turned into those of a socket. What is between "left the socket" and "through the bottleneck"
// is the bottleneck's queue, as far as the window fills it.
#include "sim/channel.h"

#include <algorithm>

namespace pmcd::sim {
namespace {

constexpr double kSegment = 1448;
constexpr double kPacket = 1500;
/// The least retransmission timeout of Linux: a connection that was idle for longer begins with its first window.
constexpr double kLeastTimeout = 0.2;
/// A sender that waits for its first acknowledgement is held, not stopped.
constexpr double kHeld = 1;

}  // namespace

double goodput(double kbit) {
  return kbit * 125 * kSegment / kPacket;
}

Channel::Channel(Uplink& uplink, const Line& line, const Tcp& tcp)
    : uplink_(&uplink),
      flow_(uplink.add()),
      down_(goodput(line.down_kbit)),
      round_trip_(line.round_trip),
      tcp_(tcp),
      window_(std::min(tcp.initial_window, enough_window())) {
  uplink_->set_cap(flow_, down_);
}

double Channel::enough_window() const {
  return down_ * round_trip_ + std::max(down_ * tcp_.queue_seconds, tcp_.queue_bytes);
}

void Channel::set_cap() {
  double cap = down_;
  if (in_first_round_) {
    if (round_trip_ > 0 && delivered() + kExact >= burst_end_) cap = kHeld;
  } else if (round_trip_ > 0) {
    cap = std::min(down_, window_ / round_trip_);
  }
  uplink_->set_cap(flow_, cap);
}

double Channel::room() const {
  if (frozen_) return 0;
  if (round_trip_ > 0 && ((in_first_round_ && delivered() + kExact >= burst_end_) ||
                          (!in_first_round_ && window_ < down_ * round_trip_))) {
    return 0;  // what the window allows is on its way
  }
  // Idle lines are asked only for what has long gone.
  const double rate = uplink_->moves(flow_) ? uplink_->rate(flow_) : down_;
  const double speed = uplink_->is_capped(flow_) ? down_ : uplink_->capacity();
  const double queue = std::max(speed * tcp_.queue_seconds, tcp_.queue_bytes) * std::min(1.0, rate / speed);
  return std::clamp(window_ - rate * round_trip_, 0.0, queue);
}

void Channel::queue(double header, double payload, double tail, std::int32_t ends_packet, double now) {
  const bool was_busy = is_busy();
  const double begin = queued_;
  queued_ += header + payload + tail;
  pieces_.push_back({begin, queued_, payload_, payload, ends_packet});
  payload_ += payload;
  if (frozen_) return;
  if (was_busy) {
    // A round counts where it may end with a larger window.
    if (!round_at_ && round_trip_ > 0 && window_ < enough_window() && !has_left(queued_)) round_at_ = now + round_trip_;
    return;
  }
  if (now - idle_since_ > std::max(kLeastTimeout, 2 * round_trip_)) window_ = std::min(window_, tcp_.initial_window);
  in_first_round_ = round_trip_ > 0;
  burst_end_ = begin + window_;
  if (round_trip_ > 0) round_at_ = now + round_trip_;
  set_cap();
  uplink_->move_to(flow_, queued_);
}

std::optional<Channel::Piece> Channel::take_delivered() {
  if (pieces_.empty() || pieces_.front().end > delivered() + kExact) return std::nullopt;
  const Piece piece = pieces_.front();
  pieces_.erase(pieces_.begin());
  return piece;
}

double Channel::delivered_payload() const {
  if (pieces_.empty()) return payload_;
  const Piece& piece = pieces_.front();
  const double part = std::clamp((delivered() - piece.begin) / (piece.end - piece.begin), 0.0, 1.0);
  return piece.payload_before + part * piece.payload;
}

void Channel::go_on(std::optional<double> unsent, std::optional<double> leaves, std::optional<double> stop_at,
                    double now) {
  if (frozen_) return;
  const double at = delivered();
  if (at + kExact >= queued_) {
    if (uplink_->moves(flow_)) idle_since_ = now;
    uplink_->stop(flow_);
    return;
  }
  if (in_first_round_) set_cap();
  double target = pieces_.front().end;
  const auto consider = [&target, at](double position) {
    if (position > at + kExact) target = std::min(target, position);
  };
  if (in_first_round_) consider(burst_end_);
  if (unsent) consider(queued_ - *unsent - room());
  if (leaves) consider(*leaves - room());
  if (stop_at) consider(*stop_at);
  uplink_->move_to(flow_, target);
}

void Channel::freeze() {
  frozen_ = true;
  round_at_.reset();
  uplink_->stop(flow_);
}

void Channel::round_over(double now) {
  round_at_.reset();
  if (frozen_) return;
  // A window grows when it was used; an idle sender keeps what it has.
  const bool was_used = !has_left(queued_) || (in_first_round_ && delivered() + kExact >= burst_end_);
  in_first_round_ = false;
  if (was_used) window_ = std::min(2 * window_, enough_window());
  if (!is_busy()) return;
  set_cap();
  if (was_used && window_ < enough_window()) round_at_ = now + round_trip_;
}

}  // namespace pmcd::sim
