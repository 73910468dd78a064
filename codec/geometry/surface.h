// SPDX-License-Identifier: MIT
// What is looked at when a vertex is predicted, in one cache line for each vertex: where it stands, the sum of its
// neighbours, its normal, how its own residual came out. Built when a packet's connectivity stands; then positions and
// sums are kept up to date, nobody walks a second ring. Sums are integers that wrap around, so the order of updates
// does not matter and nothing overflows. Normals stay as they were built: to turn them with every vertex that moves
// would save 0.02 bits a vertex or less, for a twentieth of the time. It predicts nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "codec/entropy/softmax.h"
#include "codec/geometry/ring.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

using FourWords = std::uint32_t __attribute__((vector_size(16)));  // they wrap around

inline FourWords four_words(const LatticePoint& point) {
  return (FourWords)FourInts{point[0], point[1], point[2], 0};
}

/// How far off a vertex came out, as a share of its ring's radius: within the surface and across it.
struct RelativeSpread {
  float tangential = 0.2f;
  float across = 0.2f;
};

struct alignas(64) Site {
  Four normal{};                       ///< unit length, or zero
  std::array<std::uint32_t, 3> sum{};  ///< of its neighbours' points, two's complement
  std::uint32_t neighbours = 0;
  LatticePoint point{};  ///< half lattice steps
  RelativeSpread spread;

  /// The point as seen from `origin`.
  [[nodiscard]] Four seen_from(FourWords origin) const { return lanes(load(offsetof(Site, point)) - origin); }
  /// The mean of the neighbours as seen from `origin`. REQUIRES: there are some.
  [[nodiscard]] Four neighbour_mean(FourWords origin) const {
    return lanes(load(offsetof(Site, sum)) - neighbours * origin) / static_cast<float>(neighbours);
  }

 private:
  // Three numbers and, in the fourth lane, the bits of the member behind them.
  [[nodiscard]] FourWords load(std::size_t offset) const {
    FourWords four;
    std::memcpy(&four, reinterpret_cast<const std::byte*>(this) + offset, sizeof four);
    return four;
  }
  static Four lanes(FourWords values) {
    constexpr FourWords kNotTheFourth{0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0};
    return __builtin_convertvector((FourInts)(values & kNotTheFourth), Four);
  }
};
static_assert(sizeof(Site) == 64);

class Surface {
 public:
  [[nodiscard]] const Site& operator[](std::size_t v) const { return sites_[v]; }
  Site& operator[](std::size_t v) { return sites_[v]; }

  /// The sites of all vertices of `mesh` at `points`, with the spreads that are known. [linear]
  void build(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::span<const RelativeSpread> spreads);
  /// Normals by where the vertices stand now. [linear]
  void build_normals(const HalfEdgeMesh& mesh);
  /// Vertex v, which has this ring, moves. [valence of v]
  void move(const HalfEdgeMesh& mesh, const Ring& ring, std::uint32_t v, const LatticePoint& to);

 private:
  std::vector<Site> sites_;
};

}  // namespace pmcd::codec
