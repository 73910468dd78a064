// SPDX-License-Identifier: MIT
#include "sim/cubic.h"

#include <algorithm>
#include <cmath>

namespace pmcd::sim {
namespace {

constexpr double kScale = 0.4;  ///< C
constexpr double kBeta = 717.0 / 1024;
constexpr unsigned kHystartFrom = 16;
constexpr unsigned kSamples = 8;
constexpr double kTrainGap = 0.002;
constexpr unsigned kLeastWindow = 2;

}  // namespace

void Cubic::acknowledged(unsigned packets, double round_trip, bool round_is_over, bool is_used, double now) {
  least_round_trip_ = std::min(least_round_trip_, round_trip);
  if (is_slow_start()) hystart(round_trip, round_is_over, now);
  if (!is_used) return;
  if (is_slow_start()) {
    const unsigned grown = std::min(window_ + packets, threshold_);
    packets -= grown - window_;
    window_ = grown;
  }
  if (packets > 0) avoid_congestion(packets, now);
}

void Cubic::hystart(double round_trip, bool round_is_over, double now) {
  if (round_is_over) {
    round_since_ = last_at_ = now;
    round_least_ = std::numeric_limits<double>::infinity();
    samples_ = 0;
  }
  if (window_ < kHystartFrom) return;
  if (now - last_at_ <= kTrainGap) {
    last_at_ = now;
    // Without pacing packets leave in bursts, so half a round trip of them says that the line is full.
    if (now - round_since_ > least_round_trip_ / 2) threshold_ = window_;
  }
  round_least_ = std::min(round_least_, round_trip);
  if (samples_ < kSamples) {
    ++samples_;
  } else if (round_least_ > least_round_trip_ + std::clamp(least_round_trip_ / 8, 0.004, 0.016)) {
    threshold_ = window_;
  }
}

void Cubic::avoid_congestion(unsigned packets, double now) {
  const double window = window_;
  if (!epoch_) {
    epoch_ = now;
    counted_ = packets;
    like_reno_ = window;
    to_origin_ = window < largest_ ? std::cbrt((largest_ - window) / kScale) : 0;
    origin_ = std::max(window, largest_);
  }
  const double since = now + least_round_trip_ - *epoch_ - to_origin_;
  const double target = origin_ + kScale * since * since * since;
  double per_packet = target > window ? window / (target - window) : 100 * window;
  if (largest_ == 0) per_packet = std::min(per_packet, 20.0);
  // No slower than Reno with the same way of falling would be.
  like_reno_ += packets * 3 * (1 - kBeta) / (1 + kBeta) / window;
  if (like_reno_ > window) per_packet = std::min(per_packet, window / (like_reno_ - window));
  counted_ += packets;
  const double least = std::max(per_packet, 2.0);
  if (counted_ >= least) {
    window_ += static_cast<unsigned>(counted_ / least);
    counted_ = 0;
  }
}

void Cubic::lost(bool timed_out) {
  const double window = window_;
  epoch_.reset();
  largest_ = window < largest_ ? window * (1 + kBeta) / 2 : window;
  threshold_ = std::max(static_cast<unsigned>(window * kBeta), kLeastWindow);
  if (timed_out) window_ = 1;
}

void Cubic::idle(double seconds, double timeout) {
  threshold_ = std::max(threshold_, window_ / 4 * 3);
  const unsigned restart = std::min(kFirstWindow, window_);
  for (seconds -= timeout; seconds > 0 && window_ > restart; seconds -= timeout) window_ /= 2;
  window_ = std::max(window_, restart);
  if (epoch_) epoch_.reset();
}

}  // namespace pmcd::sim
