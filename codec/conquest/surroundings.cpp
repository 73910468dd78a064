// SPDX-License-Identifier: MIT
// What a pass knows at its start, and how decisions change it. Everything here steers decoding: single precision,
// + - * / and sqrt only, every quotient and logarithm guarded.
#include <algorithm>
#include <cmath>

#include "codec/conquest/features.h"
#include "codec/conquest/hypothesis.h"

namespace pmcd::codec {

using features::at;
using features::brief_of;
using features::guarded_log2;
using features::squared;

namespace {

// Valences above are as good as this.
constexpr std::uint32_t kMaxValence = 10000;

}  // namespace

inline void Surroundings::change(Vertex& at, unsigned faces, int growth) {
  at.open = static_cast<std::uint16_t>(at.open > faces ? at.open - faces : 0);
  at.valence = static_cast<std::uint16_t>(std::clamp(at.valence + growth, 0, 2 * static_cast<int>(kMaxValence)));
  at.brief = brief_of(at.open, at.valence);
}

Surroundings::Surroundings(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, PassKind kind,
                           std::uint32_t previous, std::uint32_t most_vertices)
    : kind_(kind), previous_(previous) {
  if (kind == PassKind::ears) return;
  const std::uint32_t faces = mesh.face_count();
  face_.resize(faces);
  vertex_.reserve(std::min<std::size_t>(most_vertices, std::size_t{mesh.vertex_count()} + faces));  // one for each face
  vertex_.resize(mesh.vertex_count());
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
    vertex_[v].position = at(points[v]);
    const auto valence = static_cast<std::uint16_t>(std::min(mesh.face_valence(v), kMaxValence));
    vertex_[v].open = valence;
    vertex_[v].valence = valence;
    vertex_[v].brief = brief_of(valence, valence);
  }
  for (std::uint32_t f = 0; f < faces; ++f) {
    const Face corners = mesh.face(f);
    const Four a = vertex_[corners[0]].position;
    const Four b = vertex_[corners[1]].position;
    const Four c = vertex_[corners[2]].position;
    const Four normal = cross(b - a, c - a);
    const Four squares = squared(b - a, c - b, a - c, normal);
    const Four logs = 0.5f * guarded_log2(squares);
    face_[f] = {std::sqrt(squares[3]), logs[3], {logs[0], logs[1], logs[2]}};
    for (std::uint32_t i = 0; i < 3; ++i) {
      if (mesh.opposite(HalfEdgeMesh::halfedge(f, i)) != kNone) continue;
      has_boundary_ = true;
      change(vertex_[corners[i]], 0, 3);  // once a vertex: one boundary edge leaves it
    }
  }
}

void Surroundings::fade(float by) {
  all_.log_area *= by;
  all_.log_length *= by;
  all_.faces *= by;
}

void Surroundings::keep(const HalfEdgeMesh& mesh, std::uint32_t gate) {
  const FaceShape& face = face_[HalfEdgeMesh::face_of(gate)];
  const float edge = (face.log_length[0] + face.log_length[1] + face.log_length[2]) * (1.0f / 3.0f);
  for (std::uint32_t v : mesh.face(HalfEdgeMesh::face_of(gate))) {
    add_face(vertex_[v], face.log_area, edge);
    change(vertex_[v], 1, 0);
  }
  fade(0.98f);
  add_face(all_, face.log_area, edge);
}

void Surroundings::insert(const Hypothesis& h, const Triangulation& triangulation, const LatticePoint& position) {
  const Patch& patch = h.patch;
  fade(0.9f);
  Vertex centre;
  centre.position = at(position);
  centre.valence = static_cast<std::uint16_t>(patch.is_border() ? patch.size + 2 : patch.size);
  centre.brief = brief_of(0, centre.valence);
  for (unsigned i = 0; i < patch.size; ++i) {
    Vertex& corner = vertex_[patch.ring[i]];
    change(corner, triangulation.faces_at[i], star_faces(patch, i) - triangulation.faces_at[i]);
    if (i == patch.closing) continue;
    const float edge = (2.0f * h.log_spoke + log_length(patch.inside[i])) * (1.0f / 3.0f);
    for (Vertex* v : {&corner, &vertex_[patch.ring[i + 1 < patch.size ? i + 1 : 0]], &centre}) {
      add_face(*v, h.log_area, edge);
    }
    add_face(all_, h.log_area, edge);
  }
  vertex_.push_back(centre);
}

}  // namespace pmcd::codec
