// SPDX-License-Identifier: MIT
// One coordinate of a base vertex, given where it is expected and how far off it usually is. Wide residuals are counted
// in bins of a quarter to an eighth of that spread, so that a few models, primed with the two-sided geometric
// distribution, serve every spread; what is within the bin is coded raw. It does not predict.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "codec/base/primed.h"
#include "codec/entropy/adaptive_bit.h"

namespace pmcd::codec {

class CellModel {
 public:
  CellModel() {
    for (std::size_t k = 0; k < kClasses; ++k) {
      // Mean magnitude m of a two-sided geometric distribution: m = 2 t / (1 - t^2).
      double m = 0.15;
      for (std::size_t i = 0; i < k; ++i) m = m * 1.4142135623730951;
      const double t = (std::sqrt(1 + m * m) - 1) / m;
      for (auto& model : models_[k].nonzero) prime(model, 2 * t / (1 + t), kPriming);
      for (auto& model : models_[k].more) prime(model, t, kPriming);
    }
  }

  /// The coordinate that `value` is (writing) or was (reading); it lies in 0..most or, for damaged data only, is
  /// negative. `expectation` need not lie there. REQUIRES: spread > 0, most < 2^24.
  template <typename Source>
  std::int32_t code(Source& source, std::int32_t value, double expectation, double spread, std::int32_t most) {
    const double bounded = expectation > 0 ? (expectation < most ? expectation : most) : 0;
    auto centre = static_cast<std::int32_t>(bounded);
    if (bounded - centre >= 0.5) ++centre;
    // Bins: spreads of 4.8 and more are halved until they fall into the two last classes.
    unsigned shift = 0;
    double in_bins = spread < 1e8 ? spread : 1e8;
    while (in_bins >= 9.6 && shift < 24) {
      in_bins = in_bins * 0.5;
      ++shift;
    }
    std::size_t k = 0;
    for (double bound = 0.15 * 1.189207115; k + 1 < kClasses && in_bins >= bound; bound = bound * 1.4142135623730951)
      ++k;
    Models& models = models_[k];
    const double fraction = bounded - centre;
    const std::size_t side = shift > 0 ? 1 : (fraction < -0.15 ? 0 : (fraction > 0.15 ? 2 : 1));

    const std::int32_t half = static_cast<std::int32_t>((1u << shift) >> 1);
    const std::int32_t shifted = value - centre + half;
    const std::int32_t bin = shifted >> shift;
    if (!source.bit(models.nonzero[side], bin != 0)) return checked(source, centre - half, shifted, shift, 0, most);
    const std::size_t place = static_cast<std::size_t>(std::int64_t{centre} * 4 / (std::int64_t{most} + 1));
    const bool negative = source.bit(negative_[side][place], bin < 0);
    const std::uint32_t size = static_cast<std::uint32_t>(negative ? -bin : bin) - 1;
    std::uint32_t got = 0;
    while (got < kUnary && source.bit(models.more[got], size > got)) ++got;
    if (got == kUnary) {
      const std::uint32_t rest = size - kUnary + 1;
      unsigned length = 0;
      while (length < kMaxLength && source.bit(longer_[length], (rest >> (length + 1)) != 0)) ++length;
      got = ((1u << length) | source.raw(rest & ((1u << length) - 1), length)) + kUnary - 1;
    }
    const std::int64_t decoded = negative ? -std::int64_t{got} - 1 : std::int64_t{got} + 1;
    return checked(source, centre - half, shifted, shift, decoded, most);
  }

 private:
  static constexpr std::size_t kClasses = 13;  // 0.15 to 9.6 bins in half octaves
  static constexpr unsigned kPriming = 12;
  static constexpr std::uint32_t kUnary = 24;
  static constexpr unsigned kMaxLength = 24;

  template <typename Source>
  static std::int32_t checked(Source& source, std::int32_t from, std::int32_t shifted, unsigned shift, std::int64_t bin,
                              std::int32_t most) {
    const std::uint32_t low = source.raw(static_cast<std::uint32_t>(shifted) & ((1u << shift) - 1), shift);
    const std::int64_t result = from + (bin << shift) + low;
    return result < 0 || result > most ? -1 : static_cast<std::int32_t>(result);
  }

  struct Models {
    std::array<AdaptiveBit, 3> nonzero;
    std::array<AdaptiveBit, kUnary> more;
  };
  std::array<Models, kClasses> models_;
  std::array<std::array<AdaptiveBit, 4>, 3> negative_;
  std::array<AdaptiveBit, kMaxLength> longer_;
};

}  // namespace pmcd::codec
