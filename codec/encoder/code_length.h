// SPDX-License-Identifier: MIT
// What an ideal coder would spend, for estimates that are the same on every machine: no libm.
#pragma once

#include <bit>
#include <cstdint>

namespace pmcd::codec {

/// The binary logarithm within 0.01. REQUIRES: x a normal number > 0.
inline double binary_log(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const double above = static_cast<double>(bits & 0xFFFFFFFFFFFFF) * 0x1p-52;
  return static_cast<double>(bits >> 52) - 1023 + above + 0.3437 * above * (1 - above);
}

/// Bits to say which `part` of the `whole` something holds for.
inline double entropy(double part, double whole) {
  if (part <= 0 || part >= whole) return 0;
  return part * binary_log(whole / part) + (whole - part) * binary_log(whole / (whole - part));
}

}  // namespace pmcd::codec
