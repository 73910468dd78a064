// SPDX-License-Identifier: MIT
// A vertex's one-ring, collected once for all that look at it: neighbours in turning order and what lies across the
// edges between them. Plain indices; it computes nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

struct Ring {
  static constexpr std::size_t kMost = 12;  ///< further neighbours are not looked at

  std::array<std::uint32_t, kMost> vertex;
  std::array<std::uint32_t, kMost> apex;  ///< beyond the edge to the next vertex; kNone where nothing is
  std::size_t size = 0;
  bool border = false;  ///< first and last vertex are the border neighbours

  [[nodiscard]] std::size_t after(std::size_t i) const { return i + 1 == size ? 0 : i + 1; }
};

/// The spokes of `centre`: its ring, but where an apex belongs stands the half-edge of the face beyond. An isolated
/// vertex has none. [its valence, at most Ring::kMost]
inline void collect_spokes(const HalfEdgeMesh& mesh, std::uint32_t centre, Ring& ring) {
  ring.size = 0;
  ring.border = false;
  const std::uint32_t first = mesh.outgoing(centre);
  for (std::uint32_t h = first; h != kNone;) {
    ring.vertex[ring.size] = mesh.target(h);
    ring.apex[ring.size] = mesh.opposite(HalfEdgeMesh::next(h));
    ++ring.size;
    const std::uint32_t left = mesh.turn_left(h);
    if (left == first || ring.size == Ring::kMost) return;
    if (left == kNone) {
      ring.border = true;
      ring.vertex[ring.size] = mesh.apex(h);
      ring.apex[ring.size] = kNone;
      ++ring.size;
    }
    h = left;
  }
}

/// What collect_spokes left open.
inline void find_apexes(const HalfEdgeMesh& mesh, Ring& ring) {
  for (std::size_t i = 0; i < ring.size; ++i) {
    if (ring.apex[i] != kNone) ring.apex[i] = mesh.apex(ring.apex[i]);
  }
}

/// The ring of `centre`; empty for an isolated vertex. [its valence, at most Ring::kMost]
inline Ring collect_ring(const HalfEdgeMesh& mesh, std::uint32_t centre) {
  Ring ring;
  collect_spokes(mesh, centre, ring);
  find_apexes(mesh, ring);
  return ring;
}

}  // namespace pmcd::codec
