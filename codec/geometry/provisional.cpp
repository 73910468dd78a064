// SPDX-License-Identifier: MIT
#include "codec/geometry/provisional.h"

#include "codec/geometry/lanes.h"
#include "codec/geometry/ring_walk.h"

namespace pmcd::codec {
namespace {

LatticePoint guess(const Ring& ring, const Surface& surface, const LatticePoint& here, std::int32_t most) {
  const FourWords origin = four_words(here);
  // Half a pull towards either would fit a smooth surface better, but less is safer where provisional vertices lean on
  // each other; learnt weights were worse than these.
  constexpr float kBilaplacian = 0.3f;
  constexpr float kNormals = 0.3f;
  const float share = 1.0f / static_cast<float>(ring.size);
  Four mean{};
  for (std::size_t i = 0; i < ring.size; ++i) mean += surface[ring.vertex[i]].seen_from(origin);
  mean *= share;
  if (ring.border) {
    mean = 0.5f * (surface[ring.vertex[0]].seen_from(origin) + surface[ring.vertex[ring.size - 1]].seen_from(origin));
  }
  Four offset{};
  for (std::size_t i = 0; i < ring.size; ++i) {
    const Site& site = surface[ring.vertex[i]];
    const Four spoke = site.seen_from(origin);
    offset += kBilaplacian * (spoke - site.neighbour_mean(origin));
    offset += site.normal * (kNormals * dot(site.normal, spoke - mean));
  }
  const Four target = mean + offset * share + 0.5f;
  LatticePoint point{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float value = static_cast<float>(here[axis]) + target[axis];
    if (!(value > 0)) value = 0;
    if (value > static_cast<float>(most)) value = static_cast<float>(most);
    point[axis] = static_cast<std::int32_t>(value);
  }
  return point;
}

}  // namespace

void place_provisionally(const HalfEdgeMesh& mesh, Surface& surface, std::uint32_t first, std::int32_t most) {
  const std::uint32_t end = mesh.vertex_count();
  RingWalk<Apexes::left_out> rings(mesh, surface, first, end);
  for (std::uint32_t v = first; v < end; ++v) {
    Site& site = surface[v];
    const Ring& ring = rings.next();
    RelativeSpread sum{0, 0};
    for (std::size_t i = 0; i < ring.size; ++i) {
      const RelativeSpread& spread = surface[ring.vertex[i]].spread;
      sum.tangential += spread.tangential;
      sum.across += spread.across;
    }
    const float share = 1.0f / static_cast<float>(ring.size);
    site.spread = {sum.tangential * share, sum.across * share};
    surface.move(mesh, ring, v, guess(ring, surface, site.point, most));
  }
}

}  // namespace pmcd::codec
