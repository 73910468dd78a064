// SPDX-License-Identifier: MIT
// Floats as integers in the order of their values (-0.0 just below +0.0), and the run of floats that snap to one
// lattice index. That is how a lattice position is lifted to the exact coordinate: by its number within the run.
#pragma once

#include <bit>
#include <cstdint>

#include "codec/lattice/lattice.h"

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

/// The ordered integers of the coordinates along one axis that may occur at all: the bounding box, ends included.
struct OrderedRange {
  std::int64_t first = 0;
  std::int64_t last = 0;
};

/// Of `bounds`, those that snap to `index` along `axis`; empty (last < first) when none does.
/// REQUIRES: bounds.first <= bounds.last. [a few roundings; at worst logarithmic in the number of floats]
OrderedRange floats_in_cell(const Lattice& lattice, int axis, std::int32_t index, const OrderedRange& bounds);

}  // namespace pmcd::codec
