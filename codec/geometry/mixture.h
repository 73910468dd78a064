// SPDX-License-Identifier: MIT
// The distribution under which one coordinate is coded: logistic distributions of three widths about one mean, and
// spikes on values that structured meshes repeat. Its distribution function is an integer that never falls, so it can
// be coded directly. Weights belong to whoever made it and learn from what came. Gain at 12 bits against adaptive
// binary decisions in classes by width: 0.3 bits a vertex on scans; the spikes: 1.2 (fandisk), 0.8 (turbine), 0.4
// (horse), nothing elsewhere.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/entropy/real_tables.h"

namespace pmcd::codec {

class Mixture {
 public:
  static constexpr std::size_t kWidths = 3;
  static constexpr std::size_t kSpikes = 3;
  static constexpr std::array<double, kWidths> kWidth = {0.35, 0.7, 1.6};  // of the expected spread
  using Weights = std::array<double, kWidths>;                             // sum 1

  /// About `mean` with `spread`, in cells. `weights` is learnt from and must outlive the mixture.
  Mixture(double mean, double spread, Weights& weights) : mean_(mean), weights_(weights) {
    constexpr double kLeast = 0.04;
    for (std::size_t k = 0; k < kWidths; ++k) {
      const double width = kWidth[k] * spread + kLeast;
      inverse_[k] = 1 / width;
      reach_ = 12 * width + 2;
      share_[k] = static_cast<std::uint32_t>(weights[k] * 65535.0);
    }
  }

  /// A part of the mass, `weight` of it and some at least, stands on one value.
  void add_spike(std::int32_t value, double& weight) {
    constexpr double kLeast = 0.0004;
    Spike& spike = spikes_[spike_count_++];
    spike.at = value;
    spike.learnt = &weight;
    spike.share = static_cast<std::uint32_t>((weight < kLeast ? kLeast : weight) * body_);
    body_ -= spike.share;
  }

  [[nodiscard]] double mean() const { return mean_; }
  /// Beyond this distance from the mean nothing is expected.
  [[nodiscard]] double reach() const { return reach_; }

  /// The probability times 2^24 of lying below x, which is no whole number. Never falls.
  [[nodiscard]] std::uint32_t below(double x) const {
    const double distance = x - mean_;
    std::uint64_t mass = 0;
    for (std::size_t k = 0; k < kWidths; ++k) {
      mass += std::uint64_t{share_[k]} * LogisticTable::at(distance * inverse_[k]);
    }
    if (spike_count_ == 0) return static_cast<std::uint32_t>(mass >> 16);
    mass = (mass >> 16) * body_;
    for (std::size_t k = 0; k < spike_count_; ++k) {
      if (x > spikes_[k].at) mass += std::uint64_t{spikes_[k].share} << 24;
    }
    return static_cast<std::uint32_t>(mass >> 16);
  }

  /// About where below() reaches `mass`.
  [[nodiscard]] double quantile(std::uint64_t mass) const {
    const auto from_left = static_cast<double>(mass) + 1;
    const double from_right = 16777217.0 - from_left > 1 ? 16777217.0 - from_left : 1;
    return mean_ + real_tables::kLn2 * (fast_log2(from_left) - fast_log2(from_right)) / inverse_[1];
  }

  /// What came lies between `from` and `to`: those that expected it gain.
  void learn(double from, double to) {
    constexpr double kRate = 0.02;
    constexpr double kSpikeRate = 0.03;
    std::array<double, kWidths> part{};
    double sum = 0;
    for (std::size_t k = 0; k < kWidths; ++k) {
      const std::uint32_t mass = LogisticTable::at((to - mean_) * inverse_[k]) -  //
                                 LogisticTable::at((from - mean_) * inverse_[k]);
      part[k] = weights_[k] * (mass + 1.0);
      sum += part[k];
    }
    const double share = 1 / sum;
    for (std::size_t k = 0; k < kWidths; ++k) weights_[k] += kRate * (part[k] * share - weights_[k]);
    if (spike_count_ == 0) return;

    double total = sum * body_;
    auto hit = [&](const Spike& spike) { return spike.at > from && spike.at < to; };
    for (std::size_t k = 0; k < spike_count_; ++k) {
      if (hit(spikes_[k])) total += spikes_[k].share * 16777216.0;
    }
    for (std::size_t k = 0; k < spike_count_; ++k) {
      const double likely = hit(spikes_[k]) ? spikes_[k].share * 16777216.0 / total : 0;
      *spikes_[k].learnt += kSpikeRate * (likely - *spikes_[k].learnt);
    }
  }

 private:
  struct Spike {
    double at = 0;
    std::uint32_t share = 0;  // of 2^16
    double* learnt = nullptr;
  };

  double mean_;
  double reach_ = 0;
  std::array<double, kWidths> inverse_{};
  std::array<std::uint32_t, kWidths> share_{};  // of 2^16, together a little less
  Weights& weights_;
  std::array<Spike, kSpikes> spikes_{};
  std::size_t spike_count_ = 0;
  std::uint32_t body_ = 65536;  // what the spikes leave
};

}  // namespace pmcd::codec
