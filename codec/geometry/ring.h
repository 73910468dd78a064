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

/// The ring of `centre`, which has a face. [its valence, at most Ring::kMost]
inline Ring collect_ring(const HalfEdgeMesh& mesh, std::uint32_t centre) {
  Ring ring;
  const std::uint32_t first = mesh.outgoing(centre);
  for (std::uint32_t h = first;;) {
    ring.vertex[ring.size] = mesh.target(h);
    const std::uint32_t across = mesh.opposite(HalfEdgeMesh::next(h));
    ring.apex[ring.size] = across == kNone ? kNone : mesh.apex(across);
    ++ring.size;
    const std::uint32_t left = mesh.turn_left(h);
    if (left == first || ring.size == Ring::kMost) return ring;
    if (left == kNone) {
      ring.border = true;
      ring.vertex[ring.size] = mesh.apex(h);
      ring.apex[ring.size] = kNone;
      ++ring.size;
      return ring;
    }
    h = left;
  }
}

}  // namespace pmcd::codec
