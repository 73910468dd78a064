// SPDX-License-Identifier: MIT
// Floats as integers in the order of their values, -0.0 just below +0.0.
#pragma once

#include <bit>
#include <cstdint>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

/// REQUIRES: value is finite and, for float32, representable.
inline std::int64_t to_ordered(double value, Scalar scalar) {
  if (scalar == Scalar::float32) {
    const auto bits = std::bit_cast<std::int32_t>(static_cast<float>(value));
    return bits >= 0 ? bits : -1 - std::int64_t{bits & 0x7FFFFFFF};
  }
  const auto bits = std::bit_cast<std::int64_t>(value);
  return bits >= 0 ? bits : -1 - (bits & 0x7FFFFFFFFFFFFFFF);
}

/// REQUIRES: an integer that to_ordered answers for a finite value.
inline double from_ordered(std::int64_t ordered, Scalar scalar) {
  if (scalar == Scalar::float32) {
    const auto magnitude = static_cast<std::uint32_t>(ordered >= 0 ? ordered : -1 - ordered);
    return std::bit_cast<float>(ordered >= 0 ? magnitude : magnitude | 0x80000000u);
  }
  const auto magnitude = static_cast<std::uint64_t>(ordered >= 0 ? ordered : -1 - ordered);
  return std::bit_cast<double>(ordered >= 0 ? magnitude : magnitude | 0x8000000000000000u);
}

}  // namespace pmcd::codec
