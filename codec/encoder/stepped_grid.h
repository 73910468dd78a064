// SPDX-License-Identifier: MIT
// Finds the grid of a mesh whose few different coordinates were scaled and then rounded, to decimals or floats: gaps
// between them are multiples of one step, up to that rounding. It proves nothing: whoever uses the grid tests it.
#pragma once

#include <optional>

#include "codec/lattice/exactness_form.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

/// The grid that fits best, with some coordinate near its origin, or nothing. `fine`: what the coordinates were rounded
/// to (null: floats). `blur`: they may have been moved by as much before. [n log n]
std::optional<SteppedGrid> find_stepped_grid(const TriangleMesh& mesh, const Decimals* fine, double blur = 0);

}  // namespace pmcd::codec
