// SPDX-License-Identifier: MIT
// The distribution under which one coordinate is coded: logistic distributions of three widths about one mean, and
// spikes on values that meshes with structure repeat. Its distribution function is an integer that never falls, so it
// can be coded directly. Weights belong to whoever made it and learn from what came. Gain at 12 bits against adaptive
// binary decisions in classes by width: 0.3 bits a vertex on scans; of the spikes: 2.0 (dragon), 1.6 (fandisk), 0.5
// (horse), 0.1 or less on meshes without structure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "codec/entropy/logistic_table.h"

namespace pmcd::codec {

class Mixture {
 public:
  static constexpr std::size_t kWidths = 3;
  static constexpr std::size_t kSpikes = 4;
  using Weights = Four;  ///< of the widths, sum 1; the fourth is 0
  static constexpr Weights kEven = {0.3f, 0.5f, 0.2f, 0};
  /// Of all mass: what stands on a spike's value, and what lies about it within a rounding or two.
  struct SpikeWeights {
    float exact = 0.03f;
    float near = 0.03f;
    float rate = 0.3f;  ///< of learning; falls from use to use
  };

  /// About `mean` with `spread`, in cells. `weights` is learnt from and must outlive the mixture.
  Mixture(double mean, float spread, Weights& weights) : mean_(mean), weights_(weights) {
    constexpr Four kWidth = {0.35f, 0.7f, 1.6f, 1};  // of the expected spread
    constexpr float kLeast = 0.04f;
    const Four width = kWidth * spread + kLeast;
    inverse_ = 1.0f / width;
    inverse_[kWidths] = kNarrowness;
    reach_ = 12 * static_cast<double>(width[kWidths - 1]) + 2;
  }

  /// A part of the mass, `weights` of it and some at least, stands on one value and near it. REQUIRES: fewer than
  /// kSpikes so far, and begin_at() comes after it. |value| <= 2^26.
  void add_spike(std::int32_t value, SpikeWeights& weights) {
    Spike& spike = spikes_[spike_count_++];
    spike.at = value;
    spike.learnt = &weights;
    spike.exact = part_of_body(weights.exact);
    spike.near = part_of_body(weights.near);
  }

  /// Cells are counted from this one: all that follows means number n by the cell `first` + n. REQUIRES: called once,
  /// before all that follows; 0 <= first < 2^25.
  void begin_at(std::int32_t first) {
    const auto from_mean = static_cast<float>(first - 0.5 - mean_);
    start_ = Four{} + from_mean;
    share_ = weights_ * (body_ * kNearlyAll);
    for (std::size_t k = 0; k < spike_count_; ++k) {
      Spike& spike = spikes_[k];
      spike.at -= first;
      const std::size_t lane = k == 0 ? kWidths : k - 1;
      (k == 0 ? start_ : further_start_)[lane] = -0.5f - static_cast<float>(spike.at);
      (k == 0 ? share_ : further_share_)[lane] = spike.near * kNearlyAll;
    }
  }

  [[nodiscard]] double mean() const { return mean_; }
  /// Beyond this distance from the mean nothing is expected.
  [[nodiscard]] double reach() const { return reach_; }

  /// The probability times 2^24 of lying below cell n. Never falls. REQUIRES: begin_at was called; |n| <= 2^25.
  std::uint32_t below(std::int32_t n) {
    turn_ ^= 1;
    Seen& seen = seen_[turn_];
    seen.n = n;
    const auto cells = static_cast<float>(n);
    // Every step rounds, and none of them falls.
    seen.parts = __builtin_convertvector(LogisticTable::at((start_ + cells) * inverse_), Four);
    float mass = sum_of(share_ * seen.parts);
    if (spike_count_ > 1) {
      seen.further = __builtin_convertvector(LogisticTable::at((further_start_ + cells) * kNarrowness), Four);
      mass += sum_of(further_share_ * seen.further);
    }
    for (std::size_t k = 0; k < spike_count_; ++k) mass += n > spikes_[k].at ? spikes_[k].exact * kWhole : 0.0f;
    return static_cast<std::uint32_t>(mass < kWhole ? mass : kWhole);
  }

  /// The spike on which more than a quarter of the mass stands, as a number of its cell; null if there is none.
  [[nodiscard]] const std::int32_t* likely() const {
    const Spike* highest = nullptr;
    for (std::size_t k = 0; k < spike_count_; ++k) {
      if (spikes_[k].exact > (highest == nullptr ? 0.25f : highest->exact)) highest = &spikes_[k];
    }
    return highest == nullptr ? nullptr : &highest->at;
  }

  /// About where below() reaches `mass`: a number of cells, with its fraction.
  [[nodiscard]] float quantile(std::uint64_t mass) const {
    constexpr float kLn2 = 0.6931f;
    const float from_left = static_cast<float>(mass) + 1;
    const float from_right = kWhole + 1 - from_left > 1 ? kWhole + 1 - from_left : 1;
    return kLn2 * (fast_log2(from_left) - fast_log2(from_right)) / inverse_[1] - start_[1];
  }

  /// What came lies in the cells from `from` to before `to`: those that expected it gain. [faster if below() was asked
  /// of both last]
  void learn(std::int32_t from, std::int32_t to) {
    if (seen_[turn_].n != to || seen_[turn_ ^ 1].n != from) {
      if (seen_[turn_].n == from && seen_[turn_ ^ 1].n == to) {
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
    const Four mass = at_to.parts - at_from.parts;
    const Four part = weights_ * (mass + 1.0f);
    const float sum = sum_of(part);
    weights_ += kRate * (part * (1 / sum) - weights_);
    if (spike_count_ == 0) return;

    std::array<float, kSpikes> exact{};
    std::array<float, kSpikes> near{};
    float total = sum * body_;
    for (std::size_t k = 0; k < spike_count_; ++k) {
      const Spike& spike = spikes_[k];
      const int lane = static_cast<int>(k) - 1;
      if (spike.at >= from && spike.at < to) exact[k] = spike.exact * kWhole;
      near[k] = spike.near * (k == 0 ? mass[kWidths] : at_to.further[lane] - at_from.further[lane]);
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
  static constexpr float kWhole = 16777216;
  static constexpr float kNearlyAll = 0.99998f;  // for weights' sum is 1 but for rounding
  static constexpr float kNarrowness = 2.2f;     // about spikes: a width of 0.45 cells

  struct Seen {
    std::int32_t n = std::numeric_limits<std::int32_t>::min();
    Four parts{};    // of the three widths, of the first spike
    Four further{};  // of the other spikes
  };
  struct Spike {
    std::int32_t at;  // from begin_at() on, a number of its cell
    float exact;
    float near;
    SpikeWeights* learnt;
  };

  float part_of_body(float weight) {
    constexpr float kLeast = 0.0004f;
    const float part = (weight < kLeast ? kLeast : weight) * body_;
    body_ -= part;
    return part;
  }

  double mean_;
  double reach_;
  Weights& weights_;
  std::array<Seen, 2> seen_;  // of the last two calls of below()
  std::size_t turn_ = 0;
  Four inverse_;  // as the next two: of the three widths, of the first spike
  Four start_;
  Four share_;
  Four further_start_{};  // of the other spikes
  Four further_share_{};
  std::array<Spike, kSpikes> spikes_;  // only the first are filled
  std::size_t spike_count_ = 0;
  float body_ = 1;  // what the spikes leave
};

}  // namespace pmcd::codec
