// SPDX-License-Identifier: MIT
// Finds out whether a mesh is its own mirror image, or nearly. It codes nothing.
#pragma once

#include <span>

#include "codec/geometry/reflection.h"

namespace pmcd::codec {

/// The reflection that most vertices have an image under, within a step; none if too few have. `points` are lattice
/// steps up to `most`, `zero` is the point of the origin of coordinates. [linear, and a thousand look-ups for each of
/// the fourteen reflections that are tried]
Reflection find_reflection(std::span<const LatticePoint> points, std::int32_t most, const LatticePoint& zero);

}  // namespace pmcd::codec
