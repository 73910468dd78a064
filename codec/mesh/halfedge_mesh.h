// SPDX-License-Identifier: MIT
// Manifold, oriented triangle mesh with adjacency in flat arrays. Half-edge 3 f + c runs from corner c of face f to the
// next corner; its face lies on its left. It holds no positions and takes no decisions; patches of it are rewritten by
// conquest/patch.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/mesh/triangle_mesh.h"
#include "codec/result.h"

namespace pmcd::codec {

inline constexpr std::uint32_t kNone = 0xFFFFFFFFu;
inline constexpr std::uint32_t kMaxFaces = kNone / 4 - 1;  ///< so that half-edges have 32-bit names

class HalfEdgeMesh {
 public:
  HalfEdgeMesh() = default;

  /// Checks that `faces` form an oriented manifold, with or without boundary, and links them. Vertices in no face stay
  /// isolated. Errors: mesh_too_large, index_out_of_range, repeated_index_in_face, duplicate_face, non_manifold_edge,
  /// opposing_faces, non_manifold_vertex. [linear; 36 bytes a face and 8 a vertex remain]
  static Result<HalfEdgeMesh> build(std::span<const Face> faces, std::size_t vertex_count);

  /// Names of half-edges: edge i of face f, which starts at its corner i, is 4 f + i; the fourth name is none.
  static std::uint32_t halfedge(std::uint32_t f, std::uint32_t i) { return 4 * f + i; }
  static std::uint32_t face_of(std::uint32_t h) { return h / 4; }
  static std::uint32_t edge_of(std::uint32_t h) { return h % 4; }
  static std::uint32_t next(std::uint32_t h) { return h % 4 == 2 ? h - 2 : h + 1; }
  static std::uint32_t prev(std::uint32_t h) { return h % 4 == 0 ? h + 2 : h - 1; }

  [[nodiscard]] std::uint32_t origin(std::uint32_t h) const { return halfedge_[h].origin; }
  [[nodiscard]] std::uint32_t target(std::uint32_t h) const { return halfedge_[h + 1].origin; }
  /// The third vertex of the half-edge's face: the front vertex, when the half-edge is a gate.
  [[nodiscard]] std::uint32_t apex(std::uint32_t h) const { return halfedge_[prev(h)].origin; }
  /// The same edge in the neighbouring face; kNone at the boundary.
  [[nodiscard]] std::uint32_t opposite(std::uint32_t h) const { return halfedge_[h].opposite; }
  /// A half-edge that leaves v: at the boundary the one whose opposite is missing, so that turning left from it meets
  /// all faces of v. kNone for an isolated vertex.
  [[nodiscard]] std::uint32_t outgoing(std::uint32_t v) const { return outgoing_[v]; }
  /// Number of faces at v.
  [[nodiscard]] std::uint32_t face_valence(std::uint32_t v) const { return face_valence_[v]; }
  /// REQUIRES: v is not isolated.
  [[nodiscard]] bool is_boundary(std::uint32_t v) const { return halfedge_[outgoing_[v]].opposite == kNone; }
  /// The next half-edge that leaves origin(h), turning left; kNone at the boundary.
  [[nodiscard]] std::uint32_t turn_left(std::uint32_t h) const { return halfedge_[prev(h)].opposite; }

  /// Has the face of h brought near, for a walk that comes there soon. h may be kNone.
  void foresee(std::uint32_t h) const {
    if (h != kNone) __builtin_prefetch(&halfedge_[h]);
  }

  /// Whether a and b share an edge. [the smaller of their valences]
  [[nodiscard]] bool has_edge(std::uint32_t a, std::uint32_t b) const;
  /// The half-edge from a to b, kNone if there is none. [valence of a]
  [[nodiscard]] std::uint32_t find_halfedge(std::uint32_t a, std::uint32_t b) const;

  /// Calls visit(neighbour) for each neighbour of v, counter-clockwise. [valence of v]
  template <typename Visit>
  void for_each_neighbour(std::uint32_t v, Visit&& visit) const {
    const std::uint32_t first = outgoing_[v];
    if (first == kNone) return;
    std::uint32_t h = first;
    for (;;) {
      visit(target(h));
      const std::uint32_t left = turn_left(h);
      if (left == first) return;
      if (left == kNone) {
        visit(apex(h));
        return;
      }
      h = left;
    }
  }

  [[nodiscard]] std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(outgoing_.size()); }
  [[nodiscard]] std::uint32_t face_count() const { return static_cast<std::uint32_t>(halfedge_.size() / 4); }
  [[nodiscard]] Face face(std::uint32_t f) const {
    return {halfedge_[4 * f].origin, halfedge_[4 * f + 1].origin, halfedge_[4 * f + 2].origin};
  }

  [[nodiscard]] unsigned boundary_edges(std::uint32_t f) const {
    unsigned count = 0;
    for (std::uint32_t i = 0; i < 3; ++i) count += opposite(halfedge(f, i)) == kNone ? 1 : 0;
    return count;
  }

  // Mutation, for conquest/patch.h. It leaves the mesh whole only when the links fit together again.

  void reserve(std::uint32_t vertices, std::uint32_t faces);
  /// A new isolated vertex.
  std::uint32_t add_vertex();
  /// A new face slot; its content is undefined until set_face.
  std::uint32_t add_face();
  void set_face(std::uint32_t f, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    halfedge_[4 * f].origin = a;
    halfedge_[4 * f + 1].origin = b;
    halfedge_[4 * f + 2].origin = c;
    halfedge_[4 * f + 3].origin = a;
  }
  /// Frees a slot: its corners become kNone. The slot is not given out again until reorder() leaves it out.
  void free_face(std::uint32_t f) { set_face(f, kNone, kNone, kNone); }
  [[nodiscard]] bool is_free_slot(std::uint32_t f) const { return halfedge_[4 * f].origin == kNone; }
  /// Makes a and b opposites; b may be kNone.
  void link(std::uint32_t a, std::uint32_t b) {
    halfedge_[a].opposite = b;
    if (b != kNone) halfedge_[b].opposite = a;
  }
  /// Numbers the faces anew: number i is given to what is order[i] so far; those that are left out are no more.
  /// REQUIRES: faces once each, all that are not free slots. [linear; while it runs as much memory again as the faces
  /// have or had reserved, and 4 bytes a face]
  void reorder(std::span<const std::uint32_t> order);
  void set_outgoing(std::uint32_t v, std::uint32_t h) { outgoing_[v] = h; }
  void change_face_valence(std::uint32_t v, int by) {
    face_valence_[v] = static_cast<std::uint32_t>(static_cast<std::int64_t>(face_valence_[v]) + by);
  }

 private:
  struct HalfEdge {  // what is read together lies together
    std::uint32_t origin = kNone;
    std::uint32_t opposite = kNone;
  };
  std::vector<HalfEdge> halfedge_;  ///< four a face, a power of two; the fourth is a copy of the first's origin
  std::vector<std::uint32_t> outgoing_;
  std::vector<std::uint32_t> face_valence_;
};

}  // namespace pmcd::codec
