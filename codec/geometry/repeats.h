// SPDX-License-Identifier: MIT
// What structured meshes repeat: for each coordinate of a vertex, the value that its ring suggests most often, as one
// of the ring's own coordinates, as a corner of a parallelogram over it or as a middle between opposite vertices. All
// three axes at a time. It only counts; what a repetition is worth is learnt (mixture.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/geometry/ring.h"
#include "codec/geometry/surface.h"

namespace pmcd::codec {

/// Kinds of repetition.
enum class Repeat : std::uint8_t { coordinate = 0, corner = 1, middle = 2 };
inline constexpr std::size_t kRepeats = 3;

/// By axis: the most frequent value in cells, and how often it was met; 0: there is none.
struct Repeated {
  FourInts value{};
  FourInts times{};
};

/// `shift`: digits that a cell lacks. [square of the ring's size]
inline Repeated most_frequent(const Surface& surface, const Ring& ring, Repeat kind, unsigned shift) {
  Repeated most;
  if (kind == Repeat::middle && ring.border) return most;
  auto point = [&](std::uint32_t v) {
    const LatticePoint& p = surface[v].point;
    return FourInts{p[0], p[1], p[2], 0};
  };
  std::array<FourInts, Ring::kMost> values;
  std::size_t count = 0;
  for (std::size_t i = 0; i < ring.size; ++i) {
    FourInts value = point(ring.vertex[i]);
    if (kind == Repeat::corner) {
      if (ring.apex[i] == kNone) continue;
      value += point(ring.vertex[ring.after(i)]) - point(ring.apex[i]);
    }
    if (kind == Repeat::middle) {
      const std::size_t opposite = i + ring.size / 2 < ring.size ? i + ring.size / 2 : i + ring.size / 2 - ring.size;
      value = (value + point(ring.vertex[opposite]) + 2) >> 1;
    }
    values[count++] = value >> static_cast<std::int32_t>(shift + 1);
  }
  // The first of those met most often; a value beyond the lattice is none.
  for (std::size_t i = 0; i < count; ++i) {
    FourInts times = FourInts{} + 1;
    for (std::size_t j = i + 1; j < count; ++j) times -= values[j] == values[i];
    const FourInts better = (times > most.times) & (values[i] >= 0);
    most.times = better ? times : most.times;
    most.value = better ? values[i] : most.value;
  }
  return most;
}

}  // namespace pmcd::codec
