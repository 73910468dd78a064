// SPDX-License-Identifier: MIT
// What the coordinates of a file are whole multiples of: a power of ten, twice or five times one, or a power of two.
// All arithmetic is one or two IEEE operations on exact doubles, so that every machine rounds alike; no text, no libm.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
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
inline double power_of_ten(int exponent) {
  static constexpr std::array<double, kMaxPowerOfTen + 1> kPowers = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  return kPowers[static_cast<std::size_t>(exponent)];
}

/// Exactly 2^exponent. REQUIRES: a normal number.
inline double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

/// The double nearest to k * unit: k * multiple, exact, then one division by, or multiplication with, an exact power.
/// REQUIRES: valid(unit), |k| <= kMaxWhole. May be infinite for a power of two.
inline double multiple_of(const Unit& unit, std::int64_t k) {
  if (unit.multiple == 0) return static_cast<double>(k) * power_of_two(unit.exponent);
  const auto whole = static_cast<double>(k * unit.multiple);
  return unit.exponent < 0 ? whole / power_of_ten(-unit.exponent) : whole * power_of_ten(unit.exponent);
}

/// value / unit, not rounded to a whole number: value * 10^-exponent or value / 10^exponent, then / multiple.
/// REQUIRES: valid(unit).
inline double in_units(const Unit& unit, double value) {
  if (unit.multiple == 0) return value * power_of_two(-unit.exponent);
  const double tens = unit.exponent < 0 ? value * power_of_ten(-unit.exponent) : value / power_of_ten(unit.exponent);
  return tens / unit.multiple;
}

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
