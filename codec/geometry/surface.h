// SPDX-License-Identifier: MIT
// What each vertex knows of its one-ring, kept up to date while the mesh is refined: sum of the neighbours, sum of the
// face normals. Predicting a vertex then reads its ring once and never walks the second ring. Sums are integers that
// wrap around, so the order of updates does not matter and nothing overflows. It predicts nothing.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/conquest/patch.h"
#include "codec/conquest/triangulation.h"
#include "codec/geometry/vec.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// One vertex's surroundings, and how far its own residual lay off (of the mean edge around it).
struct RingSums {
  std::array<std::uint64_t, 3> normal{};  ///< sum over its faces of (b - a) x (c - a), two's complement
  std::array<std::uint32_t, 3> sum{};     ///< of its neighbours' lattice points, two's complement
  std::uint32_t neighbours = 0;
  float tangential = 0.2f;
  float across = 0.2f;

  [[nodiscard]] Vec normal_vector() const {
    auto value = [&](std::size_t axis) { return static_cast<double>(static_cast<std::int64_t>(normal[axis])); };
    return {value(0), value(1), value(2)};
  }
  /// REQUIRES: it has neighbours.
  [[nodiscard]] Vec neighbour_mean() const {
    auto value = [&](std::size_t axis) { return static_cast<double>(static_cast<std::int32_t>(sum[axis])); };
    const double share = 1.0 / neighbours;
    return {value(0) * share, value(1) * share, value(2) * share};
  }
};

class Surface {
 public:
  [[nodiscard]] const RingSums& operator[](std::size_t v) const { return of_[v]; }
  RingSums& operator[](std::size_t v) { return of_[v]; }

  void reserve(std::size_t count) { of_.reserve(count); }
  /// New vertices have no surroundings.
  void resize(std::size_t count) { of_.resize(count); }
  /// From nothing, for the base mesh. [linear]
  void build(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points);
  /// A patch was opened around patch.centre, which is new and has a point. [constant]
  void opened(std::span<const LatticePoint> points, const Patch& patch, const Triangulation& triangulation);
  /// Ear x was put beyond the edge that now runs b -> a in its face. [constant]
  void clipped_on(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t x);
  /// Vertex v moves from `from` to `to`; its neighbours stand where `points` says. [valence of v]
  void moved(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::uint32_t v, const LatticePoint& from,
             const LatticePoint& to);

 private:
  void add_edge(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b);
  void remove_edge(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b);
  void add_face(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t c);
  void remove_face(std::span<const LatticePoint> points, std::uint32_t a, std::uint32_t b, std::uint32_t c);

  std::vector<RingSums> of_;
};

}  // namespace pmcd::codec
