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

#include "codec/entropy/logistic_table.h"

namespace pmcd::codec {

class Mixture {
 public:
  static constexpr std::size_t kWidths = 3;
  static constexpr std::size_t kSpikes = 4;
  static constexpr Four kWidth = {0.35f, 0.7f, 1.6f, 1};  // of the expected spread; the fourth is not used
  using Weights = std::array<float, kWidths>;             // sum 1
  /// Of all mass: what stands on a spike's value, and what lies about it within a rounding or two.
  struct SpikeWeights {
    float exact = 0.03f;
    float near = 0.03f;
    float rate = 0.3f;  ///< of learning; falls from use to use
  };

  /// About `mean` with `spread`, in cells. `weights` is learnt from and must outlive the mixture.
  Mixture(double mean, float spread, Weights& weights) : mean_(mean), weights_(weights) {
    constexpr float kLeast = 0.04f;
    const Four width = kWidth * spread + kLeast;
    inverse_ = 1.0f / width;
    reach_ = 12 * static_cast<double>(width[kWidths - 1]) + 2;
    for (std::size_t k = 0; k < kWidths; ++k) share_[k] = static_cast<std::uint32_t>(weights[k] * 65535.0f);
  }

  /// A part of the mass, `weights` of it and some at least, stands on one value and near it.
  void add_spike(std::int32_t value, SpikeWeights& weights) {
    Spike& spike = spikes_[spike_count_++];
    spike.at = value;
    spike.learnt = &weights;
    spike.exact = part_of_body(weights.exact);
    spike.near = part_of_body(weights.near);
  }

  [[nodiscard]] double mean() const { return mean_; }
  /// Beyond this distance from the mean nothing is expected.
  [[nodiscard]] double reach() const { return reach_; }

  /// The probability times 2^24 of lying below x, which is no whole number. Never falls.
  std::uint32_t below(double x) {
    turn_ ^= 1;
    const auto parts = LogisticTable::at(static_cast<float>(x - mean_) * inverse_);
    seen_[turn_].x = x;
    seen_[turn_].parts = parts;
    std::uint64_t mass = 0;
    for (std::size_t k = 0; k < kWidths; ++k) mass += std::uint64_t{share_[k]} * static_cast<std::uint32_t>(parts[k]);
    if (spike_count_ == 0) return static_cast<std::uint32_t>(mass >> 16);
    mass = (mass >> 16) * body_;
    const auto nearby = near_below(x);
    seen_[turn_].nearby = nearby;
    for (std::size_t k = 0; k < spike_count_; ++k) {
      if (x > spikes_[k].at) mass += std::uint64_t{spikes_[k].exact} << 24;
      mass += std::uint64_t{spikes_[k].near} * static_cast<std::uint32_t>(nearby[k]);
    }
    return static_cast<std::uint32_t>(mass >> 16);
  }

  /// The spike on which more than a quarter of the mass stands; null if there is none.
  [[nodiscard]] const std::int32_t* likely() const {
    const Spike* highest = nullptr;
    for (std::size_t k = 0; k < spike_count_; ++k) {
      if (spikes_[k].exact > (highest == nullptr ? 16384u : highest->exact)) highest = &spikes_[k];
    }
    return highest == nullptr ? nullptr : &highest->at;
  }

  /// About where below() reaches `mass`.
  [[nodiscard]] double quantile(std::uint64_t mass) const {
    constexpr double kLn2 = 0.6931;
    const float from_left = static_cast<float>(mass) + 1;
    const float from_right = 16777217.0f - from_left > 1 ? 16777217.0f - from_left : 1;
    return mean_ + kLn2 * static_cast<double>((fast_log2(from_left) - fast_log2(from_right)) / inverse_[1]);
  }

  /// What came lies between `from` and `to`: those that expected it gain. [faster if below() was asked of both last]
  void learn(double from, double to) {
    if (seen_[turn_].x != to || seen_[turn_ ^ 1].x != from) {
      if (seen_[turn_].x == from && seen_[turn_ ^ 1].x == to) {
        turn_ ^= 1;
      } else {
        below(from);
        below(to);
      }
    }
    const Seen& at_from = seen_[turn_ ^ 1];
    const Seen& at_to = seen_[turn_];
    constexpr float kRate = 0.02f;
    constexpr float kSpikeRate = 0.025f;
    constexpr float kFall = 0.08f;
    const auto mass = at_to.parts - at_from.parts;
    std::array<float, kWidths> part{};
    float sum = 0;
    for (std::size_t k = 0; k < kWidths; ++k) {
      part[k] = weights_[k] * (static_cast<float>(mass[k]) + 1);
      sum += part[k];
    }
    const float share = 1 / sum;
    for (std::size_t k = 0; k < kWidths; ++k) weights_[k] += kRate * (part[k] * share - weights_[k]);
    if (spike_count_ == 0) return;

    const auto nearby = at_to.nearby - at_from.nearby;
    std::array<float, kSpikes> exact{};
    std::array<float, kSpikes> near{};
    float total = sum * static_cast<float>(body_);
    for (std::size_t k = 0; k < spike_count_; ++k) {
      const Spike& spike = spikes_[k];
      if (spike.at > from && spike.at < to) exact[k] = static_cast<float>(spike.exact) * 16777216.0f;
      near[k] = static_cast<float>(spike.near) * static_cast<float>(nearby[k]);
      total += exact[k] + near[k];
    }
    const float part_of_total = 1 / total;
    for (std::size_t k = 0; k < spike_count_; ++k) {
      SpikeWeights& weights = *spikes_[k].learnt;
      weights.exact += weights.rate * (exact[k] * part_of_total - weights.exact);
      weights.near += weights.rate * (near[k] * part_of_total - weights.near);
      weights.rate += (kSpikeRate - weights.rate) * kFall;
    }
  }

 private:
  struct Seen {
    double x = 0;
    LogisticTable::FourInts parts{};
    LogisticTable::FourInts nearby{};
  };
  struct Spike {
    std::int32_t at = 0;
    std::uint32_t exact = 0;  // of 2^16
    std::uint32_t near = 0;
    SpikeWeights* learnt = nullptr;
  };

  std::uint32_t part_of_body(float weight) {
    constexpr float kLeast = 0.0004f;
    const auto part = static_cast<std::uint32_t>((weight < kLeast ? kLeast : weight) * static_cast<float>(body_));
    body_ -= part;
    return part;
  }

  [[nodiscard]] LogisticTable::FourInts near_below(double x) const {
    constexpr float kNarrowness = 2.2f;  // a width of 0.45 cells
    Four distance{};
    for (int k = 0; k < static_cast<int>(kSpikes); ++k) {
      distance[k] = static_cast<float>(x - spikes_[static_cast<std::size_t>(k)].at);
    }
    return LogisticTable::at(distance * kNarrowness);
  }

  double mean_;
  double reach_ = 0;
  std::array<Seen, 2> seen_;  // of the last two calls of below()
  std::size_t turn_ = 0;
  Four inverse_{};
  std::array<std::uint32_t, kWidths> share_{};  // of 2^16, together a little less
  Weights& weights_;
  std::array<Spike, kSpikes> spikes_{};
  std::size_t spike_count_ = 0;
  std::uint32_t body_ = 65536;  // what the spikes leave
};

}  // namespace pmcd::codec
