// SPDX-License-Identifier: MIT
// What the coordinates of a file are whole multiples of: a power of ten, twice or five times one, or a power of two.
// All arithmetic is one or two IEEE operations on exact doubles, so that every machine rounds alike; no text, no libm.
#pragma once

#include <cstdint>

namespace pmcd::codec {

/// 2^exponent if multiple is 0, else multiple * 10^exponent.
struct Unit {
  std::uint8_t multiple = 1;  ///< 0, 1, 2 or 5
  std::int16_t exponent = 0;  ///< -22 to 22; of two: -1000 to 1000

  friend bool operator==(const Unit&, const Unit&) = default;
};

inline constexpr std::int16_t kMaxPowerOfTen = 22;  // the last one that a double holds exactly
inline constexpr std::int16_t kMaxPowerOfTwo = 1000;
/// Whole numbers up to this, times five, are exact doubles.
inline constexpr std::int64_t kMaxWhole = std::int64_t{1} << 50;

/// Whether a stream may claim it.
bool valid(const Unit& unit);

/// Exactly 10^exponent. REQUIRES: 0 <= exponent <= 22.
double power_of_ten(int exponent);

/// The double nearest to k * unit: k * multiple, exact, then one division by, or multiplication with, an exact power.
/// REQUIRES: valid(unit), |k| <= kMaxWhole. May be infinite for a power of two.
double multiple_of(const Unit& unit, std::int64_t k);

/// value / unit, not rounded to a whole number: value * 10^-exponent or value / 10^exponent, then / multiple.
/// REQUIRES: valid(unit).
double in_units(const Unit& unit, double value);

/// The whole numbers next to x, limited to +-kMaxWhole (0 for what is not a number).
inline std::int64_t whole_above(double x) {
  constexpr auto kMost = static_cast<double>(kMaxWhole);
  if (!(x > -kMost)) return x <= -kMost ? -kMaxWhole : 0;
  if (x >= kMost) return kMaxWhole;
  const auto k = static_cast<std::int64_t>(x);
  return static_cast<double>(k) < x ? k + 1 : k;
}
inline std::int64_t whole_below(double x) {
  return -whole_above(-x);
}

}  // namespace pmcd::codec
