// SPDX-License-Identifier: MIT
// Ears: boundary vertices with a single face. No patch of the paper can take them, and each keeps both its neighbours,
// so a mesh with a ragged boundary would end in a fat base. An ear pass clips them: beyond each boundary edge, in the
// order of half-edges, there is an ear or not. Ours, not in the paper; meshes without ears have no such pass.
#pragma once

#include <cstdint>

#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// Takes out ear x with its face; x becomes isolated. REQUIRES: face_valence(x) == 1, both neighbours have more faces.
inline void remove_ear(HalfEdgeMesh& mesh, std::uint32_t x) {
  const std::uint32_t from_x = mesh.outgoing(x);
  const std::uint32_t b = mesh.target(from_x);
  const std::uint32_t a = mesh.apex(from_x);
  const std::uint32_t beyond = mesh.opposite(HalfEdgeMesh::next(from_x));  // a -> b, boundary from now on
  mesh.link(beyond, kNone);
  mesh.set_outgoing(a, beyond);
  mesh.set_outgoing(x, kNone);
  mesh.free_face(HalfEdgeMesh::face_of(from_x));
  mesh.change_face_valence(a, -1);
  mesh.change_face_valence(b, -1);
  mesh.change_face_valence(x, -1);
}

/// Puts the isolated vertex x as an ear beyond the boundary half-edge h. REQUIRES: opposite(h) == kNone.
inline void insert_ear(HalfEdgeMesh& mesh, std::uint32_t h, std::uint32_t x) {
  const std::uint32_t a = mesh.origin(h);
  const std::uint32_t b = mesh.target(h);
  const std::uint32_t face = mesh.add_face();
  mesh.set_face(face, b, a, x);
  mesh.link(HalfEdgeMesh::halfedge(face, 0), h);
  mesh.link(HalfEdgeMesh::halfedge(face, 1), kNone);
  mesh.link(HalfEdgeMesh::halfedge(face, 2), kNone);
  mesh.set_outgoing(a, HalfEdgeMesh::halfedge(face, 1));
  mesh.set_outgoing(x, HalfEdgeMesh::halfedge(face, 2));
  mesh.change_face_valence(a, 1);
  mesh.change_face_valence(b, 1);
  mesh.change_face_valence(x, 1);
}

}  // namespace pmcd::codec
