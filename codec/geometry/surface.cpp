// SPDX-License-Identifier: MIT
#include "codec/geometry/surface.h"

namespace pmcd::codec {
namespace {

using Wide = std::array<std::uint64_t, 3>;

Wide difference(const LatticePoint& a, const LatticePoint& b) {
  Wide d{};
  for (std::size_t axis = 0; axis < 3; ++axis) d[axis] = static_cast<std::uint64_t>(std::int64_t{a[axis]} - b[axis]);
  return d;
}

Wide cross(const Wide& a, const Wide& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

void add(Wide& to, const Wide& what) {
  for (std::size_t axis = 0; axis < 3; ++axis) to[axis] += what[axis];
}

void add_neighbour(Site& to, const LatticePoint& point) {
  for (std::size_t axis = 0; axis < 3; ++axis) to.sum[axis] += static_cast<std::uint32_t>(point[axis]);
  ++to.neighbours;
}

}  // namespace

void Surface::build(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points,
                    std::span<const RelativeSpread> spreads) {
  sites_.resize(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) sites_[v].point = points[v];
  for (std::size_t v = 0; v < spreads.size(); ++v) sites_[v].spread = spreads[v];
  add_up(mesh);
}

void Surface::move_without_normals(const HalfEdgeMesh& mesh, std::uint32_t v, const LatticePoint& to) {
  Site& site = sites_[v];
  const Wide step = difference(to, site.point);
  site.point = to;
  mesh.for_each_neighbour(v, [&](std::uint32_t w) {
    for (std::size_t axis = 0; axis < 3; ++axis) sites_[w].sum[axis] += static_cast<std::uint32_t>(step[axis]);
  });
}

void Surface::add_up(const HalfEdgeMesh& mesh) {
  for (Site& site : sites_) {
    site.normal = {};
    site.sum = {};
    site.neighbours = 0;
  }
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    const Face face = mesh.face(f);
    const std::array<Site*, 3> corner = {&sites_[face[0]], &sites_[face[1]], &sites_[face[2]]};
    const Wide normal = cross(difference(corner[1]->point, corner[0]->point),  //
                              difference(corner[2]->point, corner[0]->point));
    for (std::size_t i = 0; i < 3; ++i) {
      Site& from = *corner[i];
      Site& to = *corner[i == 2 ? 0 : i + 1];
      add(from.normal, normal);
      add_neighbour(from, to.point);
      if (mesh.opposite(3 * f + static_cast<std::uint32_t>(i)) == kNone) add_neighbour(to, from.point);
    }
  }
}

void Surface::move(const HalfEdgeMesh& mesh, std::uint32_t v, const LatticePoint& to) {
  Site& site = sites_[v];
  if (site.point == to) return;
  const Wide step = difference(to, site.point);
  site.point = to;
  // (a - v) x (b - v) changes by step x (a - b) when v makes the step.
  auto turn = [&](Site& a, Site& b) {
    const Wide change = cross(step, difference(a.point, b.point));
    add(site.normal, change);
    add(a.normal, change);
    add(b.normal, change);
  };
  Site* previous = nullptr;
  Site* first = nullptr;
  mesh.for_each_neighbour(v, [&](std::uint32_t w) {
    Site& here = sites_[w];
    for (std::size_t axis = 0; axis < 3; ++axis) here.sum[axis] += static_cast<std::uint32_t>(step[axis]);
    if (previous == nullptr) {
      first = &here;
    } else {
      turn(*previous, here);
    }
    previous = &here;
  });
  if (first != nullptr && !mesh.is_boundary(v)) turn(*previous, *first);
}

}  // namespace pmcd::codec
