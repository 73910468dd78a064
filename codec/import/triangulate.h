// SPDX-License-Identifier: GPL-3.0-or-later
// Polygons to triangles: ears are clipped in the polygon's own plane, shortest diagonal first, and never along an edge
// that the mesh already has if there is another way. No vertex is added. Deterministic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct Triangulation {
  std::vector<codec::Face> faces;
  std::vector<std::uint32_t> polygon;   ///< of each face; empty if every polygon was a triangle
  std::uint64_t polygons = 0;           ///< with more than three corners
  std::uint64_t diagonals_avoided = 0;  ///< polygons cut elsewhere because a diagonal was an edge of the mesh already
  std::uint64_t not_simple = 0;         ///< polygons without an ear in their plane, cut without regard to shape
};

/// `polygon_end[p]` is the end of polygon p in `corners`. REQUIRES: each polygon has three corners or more, all
/// different and each < positions.size(). Time: linear for small polygons; at most 1024 * n for n corners in all.
Triangulation triangulate(std::span<const codec::Position> positions, std::span<const std::uint32_t> corners,
                          std::span<const std::uint32_t> polygon_end);

}  // namespace pmcd::import
