// SPDX-License-Identifier: MIT
#include "codec/encoder/precision.h"

#include <algorithm>
#include <cmath>

#include "codec/geometry/vec.h"

namespace pmcd::codec {

PrecisionPlan::PrecisionPlan(const TriangleMesh& mesh, std::span<const LatticePoint> points, Alignment alignment)
    : vertices_(std::max<double>(1, static_cast<double>(points.size()))), alignment_(alignment) {
  for (const Face& face : mesh.faces) {
    const Vec a = to_vec(points[face[0]]);
    area_ += length(cross(to_vec(points[face[1]]) - a, to_vec(points[face[2]]) - a)) / 2;
  }
}

unsigned PrecisionPlan::shift_at(std::uint32_t vertices, unsigned bits) const {
  constexpr double kCellsPerEdge = 12;
  // From this share of the mesh on, cells shrink faster than edges do.
  constexpr double kFineFrom = 1.0 / 8;
  constexpr unsigned kFewestBits = 4;
  if (alignment_ == Alignment::planes) return 0;
  const double count = std::max(1u, vertices);
  // Two equilateral triangles a vertex.
  const double edge = std::sqrt(area_ / count * 1.1547);
  const double share = count / vertices_ / kFineFrom;
  const double cells = kCellsPerEdge * (share > 1 ? share * std::sqrt(share) : 1);
  unsigned shift = 0;
  while (shift + kFewestBits < bits && static_cast<double>(2u << shift) * cells <= edge) ++shift;
  return shift;
}

Alignment alignment_of(const TriangleMesh& mesh, std::span<const LatticePoint> points) {
  std::uint64_t same = 0;
  std::uint64_t next = 0;  // one step apart, on either side
  for (const Face& face : mesh.faces) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t step = points[face[0]][axis] - points[face[1]][axis];
      same += step == 0 ? 1 : 0;
      next += step == 1 || step == -1 ? 1 : 0;
    }
  }
  // Chance makes one step apart twice as frequent as no step; among a few edges chance has its way.
  constexpr std::uint64_t kFewEdges = 100;
  if (same < kFewEdges || 20 * same < 11 * next) return Alignment::none;
  return same > 2 * next ? Alignment::planes : Alignment::some;
}

}  // namespace pmcd::codec
