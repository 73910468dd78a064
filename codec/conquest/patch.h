// SPDX-License-Identifier: MIT
// A patch is the star of one vertex or the triangulated polygon that its removal leaves: collected around a gate, and
// rewritten from one form into the other. It neither asks whether that is wise (legality.h) nor where to go next
// (conquest.h).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "codec/conquest/triangulation.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

struct Patch {
  unsigned size = 0;                                ///< ring vertices, 3 to 6
  unsigned closing = kNoClosing;                    ///< border patch: the ring edge between the two border neighbours
  std::uint32_t centre = kNone;                     ///< the vertex removed or inserted; kNone while there is none
  std::array<std::uint32_t, kMaxPatchSize> ring{};  ///< counter-clockwise, 0 = target of the gate
  std::array<std::uint32_t, kMaxPatchSize> outside{};  ///< half-edge across ring edge i, kNone at the boundary
  /// Half-edge of the polygon that is ring edge i. By collect_polygon only.
  std::array<std::uint32_t, kMaxPatchSize> inside{};
  std::array<std::uint32_t, kMaxPatchSize> slots{};  ///< face slots that the patch takes
  unsigned slot_count = 0;

  [[nodiscard]] bool is_border() const { return closing != kNoClosing; }
  [[nodiscard]] unsigned polygon_faces() const { return size - 2; }
  [[nodiscard]] unsigned star_faces() const { return is_border() ? size - 1 : size; }
  [[nodiscard]] std::span<const std::uint32_t> ring_vertices() const { return {ring.data(), size}; }
};

/// The star of the gate's front vertex, if its ring has 3 to 6 vertices (boundary: 3 or 4). False: no patch can stand
/// here. [constant]
bool collect_star(const HalfEdgeMesh& mesh, std::uint32_t gate, Patch& patch);

/// The polygon that `triangulation` describes, as it lies before the gate; every face of it must
/// be unconquered (0 in `face_marks`). For a border patch `closing` names the ring edge that must be boundary.
/// False: the faces, edges or vertices do not fit (a decoder then knows that the symbol is impossible). [constant]
bool collect_polygon(const HalfEdgeMesh& mesh, std::uint32_t gate, const Triangulation& triangulation, unsigned closing,
                     std::span<const std::uint8_t> face_marks, Patch& patch);

/// Star -> polygon: the centre becomes isolated, one or two slots are freed. REQUIRES: collect_star's patch.
void remove_centre(HalfEdgeMesh& mesh, const Patch& patch, const Triangulation& triangulation);

/// Polygon -> star around `centre` (an isolated vertex); adds the missing slots to patch.slots.
/// REQUIRES: collect_polygon's patch.
void insert_centre(HalfEdgeMesh& mesh, Patch& patch, const Triangulation& triangulation, std::uint32_t centre);

}  // namespace pmcd::codec
