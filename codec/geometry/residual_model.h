// SPDX-License-Identifier: MIT
// One lattice coordinate, given a real-valued expectation and a spread: an integer coded under models that are chosen
// by the spread (half octaves) and learn the rest. Wide spreads code their leading bits under models and the noise
// below raw. It does not predict; predictor.h does.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "codec/entropy/adaptive_bit.h"

namespace pmcd::codec {

/// floor(2 log2 x) from the bits of x. REQUIRES: x > 0 and normal.
inline int half_octave(double x) {
  constexpr double kSqrt2 = 1.4142135623730951;
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const int exponent = static_cast<int>(bits >> 52) - 1023;
  const double mantissa = std::bit_cast<double>((bits & 0x000FFFFFFFFFFFFFu) | 0x3FF0000000000000u);
  return 2 * exponent + (mantissa >= kSqrt2 ? 1 : 0);
}

class ResidualModel {
 public:
  /// The coordinate that `value` is (writing) or was (reading). `most` bounds it: the answer lies in 0..most or, for
  /// damaged data only, is negative. REQUIRES: 0 <= expectation <= most, spread > 0.
  template <typename Source>
  std::int32_t code(Source& source, std::int32_t value, double expectation, double spread, std::int32_t most) {
    auto centre = static_cast<std::int32_t>(expectation);
    if (expectation - centre >= 0.5) ++centre;
    const double fraction = expectation - centre;  // -0.5 .. 0.5
    int spread_class = half_octave(spread) + kLowest;
    if (spread_class < 0) spread_class = 0;
    if (spread_class >= kClasses) spread_class = kClasses - 1;
    Models& models = models_[static_cast<std::size_t>(spread_class)];
    const std::size_t side =
        fraction < -0.3 ? 0 : (fraction < -0.1 ? 1 : (fraction < 0.1 ? 2 : (fraction < 0.3 ? 3 : 4)));

    // The lowest bits of a wide residual are noise: a bin of 2^shift is about a tenth of the spread.
    const int octave = (spread_class - kLowest) / 2;
    const unsigned shift = octave > 3 ? static_cast<unsigned>(octave - 3) : 0;

    const std::int32_t residual = value - centre;
    if (!source.bit(models.nonzero[side], residual != 0)) return centre;
    const bool negative = source.bit(models.negative[side], residual < 0);
    const std::uint32_t size = static_cast<std::uint32_t>(negative ? -residual : residual) - 1;
    // Leading part: counted up one by one at first, then in doubling steps.
    const std::uint32_t leading = size >> shift;
    std::uint32_t got = 0;
    while (got < kUnary && source.bit(models.more[got], leading > got)) ++got;
    if (got == kUnary) {
      const std::uint32_t rest = leading - kUnary + 1;
      unsigned length = 0;
      while (length < kMaxLength && source.bit(models.longer[length], (rest >> (length + 1)) != 0)) ++length;
      got = ((1u << length) | source.raw(rest & ((1u << length) - 1), length)) + kUnary - 1;
    }
    const std::uint32_t whole = (got << shift) | source.raw(size & ((1u << shift) - 1), shift);
    if (whole >= static_cast<std::uint32_t>(most)) return -1;
    const auto step = static_cast<std::int32_t>(whole) + 1;
    const std::int32_t result = negative ? centre - step : centre + step;
    return result <= most ? result : -1;
  }

 private:
  static constexpr int kLowest = 6;    // spreads below 2^-3 share a class
  static constexpr int kClasses = 54;  // up to 2^24
  static constexpr std::uint32_t kUnary = 14;
  static constexpr unsigned kMaxLength = 24;

  struct Models {
    std::array<AdaptiveBit, 5> nonzero;
    std::array<AdaptiveBit, 5> negative;
    std::array<AdaptiveBit, kUnary> more;
    std::array<AdaptiveBit, kMaxLength> longer;
  };
  std::array<Models, kClasses> models_;
};

}  // namespace pmcd::codec
