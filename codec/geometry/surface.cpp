// SPDX-License-Identifier: MIT
#include "codec/geometry/surface.h"

#include <cmath>

#include "codec/geometry/lanes.h"

namespace pmcd::codec {
namespace {

// The face's normal, twice its area long, to those of its vertices.
void add_normal(std::vector<Site>& sites, const Face& face) {
  const FourWords origin = four_words(sites[face[0]].point);
  const Four normal = cross(sites[face[1]].seen_from(origin), sites[face[2]].seen_from(origin));
  for (const std::uint32_t v : face) sites[v].normal += normal;
}

void normalise(std::vector<Site>& sites) {
  constexpr float kSmallest = 1e-6f;  // squared
  for (Site& site : sites) {
    const float square = dot(site.normal, site.normal);
    site.normal *= square > kSmallest ? 1 / std::sqrt(square) : 0;
  }
}

void add_neighbour(Site& to, const LatticePoint& point) {
  for (std::size_t axis = 0; axis < 3; ++axis) to.sum[axis] += static_cast<std::uint32_t>(point[axis]);
  ++to.neighbours;
}

}  // namespace

void Surface::build(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points,
                    std::span<const RelativeSpread> spreads) {
  sites_.resize(points.size());  // spreads that are guessed stay
  for (std::size_t v = 0; v < points.size(); ++v) {
    sites_[v].point = points[v];
    sites_[v].sum = {};
    sites_[v].neighbours = 0;
    sites_[v].normal = Four{};
  }
  for (std::size_t v = 0; v < spreads.size(); ++v) sites_[v].spread = spreads[v];
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) {
    const Face face = mesh.face(f);
    for (std::size_t i = 0; i < 3; ++i) {
      Site& from = sites_[face[i]];
      Site& to = sites_[face[i == 2 ? 0 : i + 1]];
      add_neighbour(from, to.point);
      const std::uint32_t h = HalfEdgeMesh::halfedge(f, static_cast<std::uint32_t>(i));
      if (mesh.opposite(h) == kNone) add_neighbour(to, from.point);
    }
    add_normal(sites_, face);
  }
  normalise(sites_);
}

void Surface::build_normals(const HalfEdgeMesh& mesh) {
  for (Site& site : sites_) site.normal = Four{};
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) add_normal(sites_, mesh.face(f));
  normalise(sites_);
}

void Surface::move(const HalfEdgeMesh& mesh, const Ring& ring, std::uint32_t v, const LatticePoint& to) {
  Site& site = sites_[v];
  const FourWords step = four_words(to) - four_words(site.point);
  site.point = to;
  auto tell = [&](std::uint32_t w) {
    for (std::size_t axis = 0; axis < 3; ++axis) sites_[w].sum[axis] += step[static_cast<int>(axis)];
  };
  if (ring.size < Ring::kMost) {
    for (std::size_t i = 0; i < ring.size; ++i) tell(ring.vertex[i]);
  } else {
    mesh.for_each_neighbour(v, tell);
  }
}

}  // namespace pmcd::codec
