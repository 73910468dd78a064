// SPDX-License-Identifier: MIT
// One lattice coordinate, or further digits of it, coded under a mixture (mixture.h) whose weights are learnt in
// classes by spread and by how many coordinates of the vertex are known already. It does not predict; predictor.h does.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "codec/entropy/integer_model.h"
#include "codec/entropy/softmax.h"
#include "codec/geometry/mixture.h"

namespace pmcd::codec {

/// A value that a coordinate may repeat, of which kind (below Mixture::kSpikes) it is, and how much speaks for it (a
/// context below kSpikeContexts).
struct RepeatedValue {
  std::int32_t value = 0;
  std::size_t kind = 0;
  std::size_t context = 0;
};
inline constexpr std::size_t kSpikeContexts = 96;

class CoordinateModel {
 public:
  CoordinateModel() {
    for (auto& of_order : weights_) of_order.fill(Mixture::kEven);
  }

  /// `mean` and `spread` in cells; `order`: how many coordinates of the vertex are known, 0 to 2; `repeated`: one
  /// value at most of a kind. REQUIRES: 0 < spread, for code() <= 2^24; mean within -2^30 .. 2^30.
  Mixture mixture(double mean, float spread, std::size_t order, std::span<const RepeatedValue> repeated) {
    const int half_octave = static_cast<int>(2 * fast_log2(spread) + 64.0f) - 64 + kLowest;
    Mixture mixture(mean, spread, weights_[order][static_cast<std::size_t>(std::clamp(half_octave, 0, kClasses - 1))]);
    for (const RepeatedValue& r : repeated) mixture.add_spike(r.value, spike_weights_[r.kind][r.context]);
    return mixture;
  }

  /// A cell index from 0 to `most`; a negative answer: damaged data.
  template <typename Source>
  std::int32_t code(Source& source, std::int32_t value, Mixture& mixture, std::int32_t most) {
    // Bins of 2^shift cells; below them nothing can be known.
    unsigned shift = 0;
    while (mixture.reach() * 2 > static_cast<double>(std::int64_t{kMostBins} << shift)) ++shift;
    auto bin_of = [&](double cell) {
      return static_cast<std::int32_t>(std::clamp(cell, 0.0, static_cast<double>(most))) >> shift;
    };
    const std::int32_t base = bin_of(mixture.mean() - mixture.reach());
    const auto bins = static_cast<std::uint32_t>(bin_of(mixture.mean() + mixture.reach() + 1) - base) + 1;
    mixture.begin_at(base << shift);
    auto edge = [&](std::uint32_t bin) { return static_cast<std::int32_t>(bin << shift); };

    // Symbols: something below the bins, the bins, something above them.
    constexpr std::uint32_t kTotal = 1u << 24;
    constexpr std::uint32_t kEscape = 96;
    const std::uint32_t spare = kTotal - 2 * kEscape - bins;
    auto cumulative = [&](std::uint32_t symbol) -> std::uint32_t {
      if (symbol == 0) return 0;
      if (symbol == bins + 2) return kTotal;
      const std::uint64_t mass = mixture.below(edge(symbol - 1));
      return kEscape + (symbol - 1) + static_cast<std::uint32_t>((mass * spare) >> 24);
    };
    auto guess = [&](std::uint64_t scaled) {
      const std::int32_t* likely = mixture.likely();
      const auto cells = static_cast<float>(bins << shift);
      const std::int32_t cell =
          likely != nullptr ? *likely : static_cast<std::int32_t>(std::clamp(mixture.quantile(scaled), 0.0f, cells));
      return static_cast<std::uint32_t>(std::clamp(cell >> shift, 0, static_cast<std::int32_t>(bins) - 1)) + 1;
    };
    std::uint32_t wanted = 0;
    if ((value >> shift) >= base) wanted = std::min(static_cast<std::uint32_t>((value >> shift) - base), bins) + 1;
    const std::uint32_t symbol = source.symbol(wanted, bins + 2, guess, cumulative);

    const std::int64_t first = std::int64_t{base} << shift;
    const std::int64_t end = first + (std::int64_t{bins} << shift);
    std::int64_t result = 0;
    if (symbol == 0) {
      result = first - 1 - beyond_.code(source, static_cast<std::uint32_t>(first - 1 - value));
    } else if (symbol == bins + 1) {
      result = end + beyond_.code(source, static_cast<std::uint32_t>(value - end));
    } else {
      mixture.learn(edge(symbol - 1), edge(symbol));
      const std::uint32_t low = source.raw(static_cast<std::uint32_t>(value) & ((1u << shift) - 1), shift);
      result = first + (std::int64_t{symbol - 1} << shift) + low;
    }
    return result >= 0 && result <= most ? static_cast<std::int32_t>(result) : -1;
  }

  /// A cell index of which all but the lowest `digits` binary digits are known: it lies in `known` << digits and after.
  /// REQUIRES: 1 <= digits <= kMostDigits.
  template <typename Source>
  std::int32_t code_digits(Source& source, std::int32_t value, Mixture& mixture, std::int32_t known, unsigned digits) {
    const std::int32_t first = known << digits;
    mixture.begin_at(first);
    const std::uint32_t below = mixture.below(0);
    const std::uint32_t least = 8192u >> digits;  // of 2^24, to each: the cell may lie where nothing was expected
    auto cumulative = [&](std::uint32_t symbol) -> std::uint32_t {
      return mixture.below(static_cast<std::int32_t>(symbol)) - below + symbol * least;
    };
    auto guess = [&](std::uint64_t /*scaled*/) { return (1u << digits) / 2; };
    const std::uint32_t symbol =
        source.symbol(static_cast<std::uint32_t>(value - first), 1u << digits, guess, cumulative);
    mixture.learn(static_cast<std::int32_t>(symbol), static_cast<std::int32_t>(symbol) + 1);
    return first + static_cast<std::int32_t>(symbol);
  }
  static constexpr unsigned kMostDigits = 8;

 private:
  static constexpr std::int32_t kMostBins = 1 << 11;
  static constexpr int kClasses = 20;
  static constexpr int kLowest = 6;  // spreads below 2^-3 cells share a class

  std::array<std::array<Mixture::Weights, kClasses>, 3> weights_;
  std::array<std::array<Mixture::SpikeWeights, kSpikeContexts>, Mixture::kSpikes> spike_weights_;
  UnsignedModel beyond_;
};

}  // namespace pmcd::codec
