// SPDX-License-Identifier: MIT
// The one-rings of vertices in turn. A walk over vertices is a walk over memory: what the next ones need, of the mesh
// and of the surface, is fetched while the present one is looked at. Gain: 3 % of the time that a mesh of 437,000
// vertices takes; nothing depends on it but speed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/geometry/ring.h"
#include "codec/geometry/surface.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// Without apexes only the ring's vertices are looked for; what stands for the apexes then means nothing.
enum class Apexes : std::uint8_t { found, left_out };

template <Apexes kApexes = Apexes::found>
class RingWalk {
 public:
  /// Over the vertices from `first` to before `end`. `mesh` and `surface` must outlive the walk; the mesh stays as it
  /// is.
  RingWalk(const HalfEdgeMesh& mesh, const Surface& surface, std::uint32_t first, std::uint32_t end)
      : mesh_(mesh), surface_(surface), present_(first), end_(end) {
    collect(first);
    collect(first + 1);
    finish(first);
  }

  /// The ring of the next vertex, empty if that is isolated; it holds until the next call. REQUIRES: there is one more.
  const Ring& next() {
    const std::uint32_t v = present_++;
    if (v + kFarAhead < end_) mesh_.foresee(mesh_.outgoing(v + kFarAhead));
    collect(v + 2);
    finish(v + 1);
    return rings_[v % kKept];
  }

 private:
  static constexpr std::uint32_t kKept = 4;
  static constexpr std::uint32_t kFarAhead = 6;

  void collect(std::uint32_t v) {
    if (v >= end_) return;
    Ring& ring = rings_[v % kKept];
    collect_spokes(mesh_, v, ring);
    for (std::size_t i = 0; i < ring.size; ++i) {
      if constexpr (kApexes == Apexes::found) mesh_.foresee(ring.apex[i]);
      __builtin_prefetch(&surface_[ring.vertex[i]]);
    }
  }
  void finish(std::uint32_t v) {
    if (kApexes == Apexes::left_out || v >= end_) return;
    Ring& ring = rings_[v % kKept];
    find_apexes(mesh_, ring);
    for (std::size_t i = 0; i < ring.size; ++i) {
      if (ring.apex[i] != kNone) __builtin_prefetch(&surface_[ring.apex[i]]);
    }
  }

  const HalfEdgeMesh& mesh_;
  const Surface& surface_;
  std::uint32_t present_;
  std::uint32_t end_;
  std::array<Ring, kKept> rings_;
};

}  // namespace pmcd::codec
