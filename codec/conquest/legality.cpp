// SPDX-License-Identifier: MIT
#include "codec/conquest/legality.h"

#include <cmath>

#include "codec/geometry/vec.h"

namespace pmcd::codec {
bool keeps_manifold(const HalfEdgeMesh& mesh, const Patch& patch, const Triangulation& triangulation) {
  if (patch.size == 3 && !patch.is_border()) {
    // No new edge; the new face must not be there already, on the other side of its first ring edge.
    const std::uint32_t beyond = patch.outside[0];
    return beyond == kNone || mesh.apex(beyond) != patch.ring[2];
  }
  if (patch.is_border() && mesh.has_edge(patch.ring[patch.closing], patch.ring[patch.closing + 1])) return false;
  for (unsigned k = 0; k < triangulation.triangles; ++k) {
    for (unsigned e = 0; e < 3; ++e) {
      if (triangulation.ring_edge[k][e] != Triangulation::kDiagonal) continue;
      const std::uint32_t a = patch.ring[triangulation.corner[k][e]];
      const std::uint32_t b = patch.ring[triangulation.corner[k][(e + 1) % 3]];
      if (a < b && mesh.has_edge(a, b)) return false;  // each diagonal is met from both sides
    }
  }
  return true;
}

bool keeps_shape(std::span<const LatticePoint> points, const Patch& patch, const Triangulation& triangulation,
                 const GeometricLimits& limits) {
  if (limits.min_flip_cosine <= -1 && !limits.max_shape_error) return true;
  const Vec centre = to_vec(points[patch.centre]);
  std::array<Vec, kMaxPatchSize> spoke;
  for (unsigned i = 0; i < patch.size; ++i) spoke[i] = to_vec(points[patch.ring[i]]) - centre;
  Vec normal{};  // of the star, area-weighted
  double perimeter = 0;
  for (unsigned i = 0; i < patch.size; ++i) {
    const Vec& a = spoke[i];
    const Vec& b = spoke[(i + 1) % patch.size];
    perimeter += length(b - a);
    if (i != patch.closing) normal = normal + cross(a, b);
  }
  const double normal_length = length(normal);
  double volume = 0;
  for (unsigned k = 0; k < triangulation.triangles; ++k) {
    const auto& corner = triangulation.corner[k];
    const Vec& a = spoke[corner[0]];
    const Vec face = cross(spoke[corner[1]] - a, spoke[corner[2]] - a);
    volume += std::abs(dot(a, face)) / 6;
    if (dot(face, normal) < limits.min_flip_cosine * length(face) * normal_length) return false;
  }
  if (!limits.max_shape_error) return true;
  const double bound = *limits.max_shape_error * perimeter / patch.size;
  return volume <= bound * bound * bound;
}

}  // namespace pmcd::codec
