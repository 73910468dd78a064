// SPDX-License-Identifier: MIT
#include "codec/geometry/surface.h"

namespace pmcd::codec {
namespace {

using Wide = std::array<std::uint64_t, 3>;

Wide difference(const LatticePoint& a, const LatticePoint& b) {
  Wide d{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    d[axis] = static_cast<std::uint64_t>(std::int64_t{a[axis]} - std::int64_t{b[axis]});
  }
  return d;
}

Wide wide_cross(const Wide& a, const Wide& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Wide face_normal(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return wide_cross(difference(points[b], points[a]), difference(points[c], points[a]));
}

void add(Wide& to, const Wide& what) {
  for (std::size_t axis = 0; axis < 3; ++axis) to[axis] += what[axis];
}

void subtract(Wide& from, const Wide& what) {
  for (std::size_t axis = 0; axis < 3; ++axis) from[axis] -= what[axis];
}

}  // namespace

void Surface::add_edge(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    of_[a].sum[axis] += static_cast<std::uint32_t>(points[b][axis]);
    of_[b].sum[axis] += static_cast<std::uint32_t>(points[a][axis]);
  }
  ++of_[a].neighbours;
  ++of_[b].neighbours;
}

void Surface::remove_edge(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    of_[a].sum[axis] -= static_cast<std::uint32_t>(points[b][axis]);
    of_[b].sum[axis] -= static_cast<std::uint32_t>(points[a][axis]);
  }
  --of_[a].neighbours;
  --of_[b].neighbours;
}

void Surface::add_face(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const Wide normal = face_normal(points, a, b, c);
  add(of_[a].normal, normal);
  add(of_[b].normal, normal);
  add(of_[c].normal, normal);
}

void Surface::remove_face(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const Wide normal = face_normal(points, a, b, c);
  subtract(of_[a].normal, normal);
  subtract(of_[b].normal, normal);
  subtract(of_[c].normal, normal);
}

void Surface::build(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points) {
  of_.assign(points.size(), {});
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    const Face face = mesh.face(f);
    add_face(points, face[0], face[1], face[2]);
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
      const std::uint32_t across = mesh.opposite(h);
      if (across == kNone || h < across) add_edge(points, mesh.origin(h), mesh.target(h));
    }
  }
}

void Surface::opened(std::span<const LatticePoint> points, const Patch& patch, const Triangulation& triangulation) {
  for (unsigned k = 0; k < triangulation.triangles; ++k) {
    const auto& corner = triangulation.corner[k];
    remove_face(points, patch.ring[corner[0]], patch.ring[corner[1]], patch.ring[corner[2]]);
    for (unsigned e = 0; e < 3; ++e) {
      const std::uint8_t a = corner[e];
      const std::uint8_t b = corner[(e + 1) % 3];
      const std::uint8_t edge = triangulation.ring_edge[k][e];
      const bool gone = edge == Triangulation::kDiagonal ? a < b  // met from both sides
                                                         : edge == patch.closing;
      if (gone) {
        remove_edge(points, patch.ring[a], patch.ring[b]);
      }
    }
  }
  for (unsigned i = 0; i < patch.size; ++i) {
    add_edge(points, patch.ring[i], patch.centre);
    if (i != patch.closing) add_face(points, patch.ring[i], patch.ring[(i + 1) % patch.size], patch.centre);
  }
}

void Surface::clipped_on(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t x) {
  add_edge(points, a, x);
  add_edge(points, b, x);
  add_face(points, b, a, x);
}

void Surface::moved(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::uint32_t v,
                    const LatticePoint& from, const LatticePoint& to) {
  if (from == to) return;
  const Wide step = difference(to, from);
  // (a - v) x (b - v) changes by step x (a - b) when v makes the step.
  auto turn = [&](std::uint32_t a, std::uint32_t b) {
    const Wide change = wide_cross(step, difference(points[a], points[b]));
    add(of_[v].normal, change);
    add(of_[a].normal, change);
    add(of_[b].normal, change);
  };
  std::uint32_t previous = kNone;
  std::uint32_t first = kNone;
  mesh.for_each_neighbour(v, [&](std::uint32_t w) {
    for (std::size_t axis = 0; axis < 3; ++axis) of_[w].sum[axis] += static_cast<std::uint32_t>(step[axis]);
    if (previous == kNone) {
      first = w;
    } else {
      turn(previous, w);
    }
    previous = w;
  });
  if (first != kNone && !mesh.is_boundary(v)) turn(previous, first);
}

}  // namespace pmcd::codec
