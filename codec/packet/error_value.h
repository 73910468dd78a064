// SPDX-License-Identifier: MIT
// A level's error as 16 bits: a number with 6 bits of exponent and 10 of mantissa, which is as exact as anybody wants
// to know it. 0 is 0, 0xFFFF "not measured", any other c stands for (1 + (c mod 1024) / 1024) * 2^(floor(c / 1024) -
// 50).
#pragma once

#include <bit>
#include <cstdint>

namespace pmcd::codec {

inline constexpr std::uint16_t kNotMeasured = 0xFFFF;

namespace error_value {
inline constexpr unsigned kDroppedBits = 42;                            // of a double's 52 bits of mantissa
inline constexpr std::uint64_t kBase = std::uint64_t{1023 - 50} << 10;  // a double's exponent and mantissa at code 0
}  // namespace error_value

/// The code of the nearest value (relative distance at most 2^-11). Positive values below 2^-50 count as the smallest
/// there is, so that only 0 becomes 0; those above 2^14 as the largest; negative ones and NaN as not measured.
inline std::uint16_t error_code_of(double value) {
  constexpr std::uint16_t kMost = kNotMeasured - 1;
  if (!(value >= 0)) return kNotMeasured;
  if (value == 0) return 0;
  const auto bits = std::bit_cast<std::uint64_t>(value);
  const std::uint64_t rounded =
      (bits + (std::uint64_t{1} << (error_value::kDroppedBits - 1))) >> error_value::kDroppedBits;
  if (rounded <= error_value::kBase) return 1;
  const std::uint64_t code = rounded - error_value::kBase;
  return code < kMost ? static_cast<std::uint16_t>(code) : kMost;
}

/// -1: not measured.
inline double error_of_code(std::uint16_t code) {
  if (code == kNotMeasured) return -1;
  if (code == 0) return 0;
  return std::bit_cast<double>((error_value::kBase + code) << error_value::kDroppedBits);
}

}  // namespace pmcd::codec
