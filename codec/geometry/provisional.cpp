// SPDX-License-Identifier: MIT
#include "codec/geometry/provisional.h"

#include "codec/geometry/ring.h"

namespace pmcd::codec {

void place_provisionally(const HalfEdgeMesh& mesh, std::span<LatticePoint> points, Surface& surface, std::uint32_t v,
                         std::int32_t most) {
  // Half a pull towards either would fit a smooth surface better, but less is safer where provisional vertices lean on
  // each other; learnt weights were worse than these.
  constexpr double kBilaplacian = 0.3;
  constexpr double kNormals = 0.3;
  const Ring ring = collect_ring(mesh, v);
  const double share = 1.0 / static_cast<double>(ring.size);
  Vec mean{};
  for (std::size_t i = 0; i < ring.size; ++i) mean = mean + to_vec(points[ring.vertex[i]]);
  mean = mean * share;
  if (ring.border) mean = (to_vec(points[ring.vertex[0]]) + to_vec(points[ring.vertex[ring.size - 1]])) * 0.5;
  Vec offset{};
  double tangential = 0;
  double across = 0;
  for (std::size_t i = 0; i < ring.size; ++i) {
    const RingSums& around = surface[ring.vertex[i]];
    const Vec here = to_vec(points[ring.vertex[i]]);
    offset = offset + (here - around.neighbour_mean()) * kBilaplacian;
    const Vec n = around.normal_vector();
    const double square = dot(n, n);
    if (square > 1e-6) offset = offset + n * (kNormals * dot(n, here - mean) / square);
    tangential += static_cast<double>(around.tangential);
    across += static_cast<double>(around.across);
  }
  surface[v].tangential = static_cast<float>(tangential * share);
  surface[v].across = static_cast<float>(across * share);
  LatticePoint to{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double value = mean[axis] + offset[axis] * share + 0.5;
    if (!(value > 0)) value = 0;
    if (value > most) value = most;
    to[axis] = static_cast<std::int32_t>(value);
  }
  surface.moved(mesh, points, v, points[v], to);
  points[v] = to;
}

}  // namespace pmcd::codec
