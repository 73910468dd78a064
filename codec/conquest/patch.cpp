// SPDX-License-Identifier: MIT
#include "codec/conquest/patch.h"

#include "codec/conquest/triangulation_table.h"

namespace pmcd::codec {
namespace {

using Halfedges = std::array<std::uint32_t, kMaxPatchSize>;

// After the ring edges got new half-edges: links them to what lies outside and gives every ring vertex an outgoing
// half-edge again. `was_boundary` was asked before the faces were rewritten.
void attach_ring(HalfEdgeMesh& mesh, const Patch& patch, const Halfedges& ring_halfedge,
                 const std::array<bool, kMaxPatchSize>& was_boundary) {
  for (unsigned i = 0; i < patch.size; ++i) {
    if (i == patch.closing) continue;
    mesh.link(ring_halfedge[i], patch.outside[i]);
    if (!was_boundary[i] || patch.outside[i] == kNone) mesh.set_outgoing(patch.ring[i], ring_halfedge[i]);
  }
}

std::array<bool, kMaxPatchSize> boundary_flags(const HalfEdgeMesh& mesh, const Patch& patch) {
  std::array<bool, kMaxPatchSize> flags{};
  for (unsigned i = 0; i < patch.size; ++i) flags[i] = mesh.is_boundary(patch.ring[i]);
  return flags;
}

// Faces of a star at ring vertex i: two, at the ends of a border patch one.
int star_valence(const Patch& patch, unsigned i) {
  return patch.is_border() && (i == patch.closing || i == patch.closing + 1) ? 1 : 2;
}

void change_valences(HalfEdgeMesh& mesh, const Patch& patch, const Triangulation& triangulation, int sign) {
  for (unsigned i = 0; i < patch.size; ++i) {
    mesh.change_face_valence(patch.ring[i], sign * (star_valence(patch, i) - triangulation.faces_at[i]));
  }
}

}  // namespace

bool collect_star(const HalfEdgeMesh& mesh, std::uint32_t gate, Patch& patch) {
  const std::uint32_t centre = mesh.apex(gate);
  const std::uint32_t faces = mesh.face_valence(centre);
  const bool border = mesh.is_boundary(centre);
  if (border ? faces < 2 || faces > 3 : faces < 3 || faces > kMaxPatchSize) return false;
  patch.centre = centre;
  patch.size = border ? faces + 1 : faces;
  patch.slot_count = faces;
  patch.closing = kNoClosing;
  // Turning left around the centre: the ring edge of each face in turn, the gate's last.
  std::uint32_t ring_edge = gate;
  unsigned slot = 0;
  for (unsigned i = 0; i < patch.size; ++i) {
    const unsigned edge = i == 0 ? patch.size - 1 : i - 1;
    patch.ring[edge] = mesh.origin(ring_edge);
    patch.outside[edge] = mesh.opposite(ring_edge);
    patch.slots[slot++] = HalfEdgeMesh::face_of(ring_edge);
    if (i + 1 == patch.size) break;
    const std::uint32_t across = mesh.opposite(HalfEdgeMesh::next(ring_edge));
    if (across != kNone) {
      ring_edge = HalfEdgeMesh::next(across);
      continue;
    }
    // The right end of a border fan: its last ring vertex is b; go on at a.
    ++i;
    patch.closing = i == 0 ? patch.size - 1 : i - 1;
    patch.ring[patch.closing] = mesh.target(ring_edge);
    patch.outside[patch.closing] = kNone;
    if (i + 1 == patch.size) break;
    ring_edge = HalfEdgeMesh::next(mesh.outgoing(centre));
  }
  return true;
}

namespace {

// For one triangulation, known when this is compiled: loops and tables vanish.
template <unsigned kShape>
bool collect(const HalfEdgeMesh& mesh, std::uint32_t gate, std::span<const std::uint8_t> face_marks, Patch& patch) {
  constexpr const Triangulation& kT = *kShapes[kShape];
  std::array<std::array<std::uint32_t, 3>, 4> halfedge;  // of each triangle, from its entry on
  auto take = [&]<std::size_t k>() {
    std::uint32_t entry = gate;
    if constexpr (k > 0) {
      constexpr auto kStep = kT.step[k];
      constexpr unsigned kFrom = (kStep.from_edge + 3u - kT.step[kStep.from_triangle].entry_edge) % 3;
      entry = mesh.opposite(halfedge[kStep.from_triangle][kFrom]);
      if (entry == kNone) return false;
    }
    const std::uint32_t face = HalfEdgeMesh::face_of(entry);
    if (face_marks[face] != 0) return false;
    patch.slots[k] = face;
    halfedge[k] = {entry, HalfEdgeMesh::next(entry), HalfEdgeMesh::prev(entry)};
    auto name = [&]<std::size_t e>() {
      const std::uint32_t h = halfedge[k][(e + 3u - kT.step[k].entry_edge) % 3];
      patch.ring[kT.corner[k][e]] = mesh.origin(h);
      if constexpr (kT.ring_edge[k][e] != Triangulation::kDiagonal) {
        patch.inside[kT.ring_edge[k][e]] = h;
        patch.outside[kT.ring_edge[k][e]] = mesh.opposite(h);
      }
    };
    name.template operator()<0>();
    name.template operator()<1>();
    name.template operator()<2>();
    return true;
  };
  bool fits = take.template operator()<0>();
  if constexpr (kT.triangles > 1) fits = fits && take.template operator()<1>();
  if constexpr (kT.triangles > 2) fits = fits && take.template operator()<2>();
  if constexpr (kT.triangles > 3) fits = fits && take.template operator()<3>();
  if (!fits) return false;
  patch.size = kT.size;
  patch.closing = kNoClosing;
  patch.centre = kNone;
  patch.slot_count = kT.triangles;
  bool apart = true;
  for (unsigned i = 0; i < kT.apart_count; ++i) {
    apart = apart && patch.ring[kT.apart[i][0]] != patch.ring[kT.apart[i][1]];
  }
  return apart;
}

}  // namespace

bool collect_polygon(const HalfEdgeMesh& mesh, std::uint32_t gate, const Triangulation& triangulation, unsigned closing,
                     std::span<const std::uint8_t> face_marks, Patch& patch) {
  static constexpr std::array kCollect = {collect<0>, collect<1>, collect<2>, collect<3>,
                                          collect<4>, collect<5>, collect<6>, collect<7>};
  if (!kCollect[triangulation.shape](mesh, gate, face_marks, patch)) return false;
  patch.closing = closing;
  return closing == kNoClosing || patch.outside[closing] == kNone;
}

void remove_centre(HalfEdgeMesh& mesh, const Patch& patch, const Triangulation& triangulation) {
  const auto was_boundary = boundary_flags(mesh, patch);
  Halfedges ring_halfedge{};
  for (unsigned k = 0; k < triangulation.triangles; ++k) {
    const auto& corner = triangulation.corner[k];
    const std::uint32_t slot = patch.slots[k];
    mesh.set_face(slot, patch.ring[corner[0]], patch.ring[corner[1]], patch.ring[corner[2]]);
    for (unsigned e = 0; e < 3; ++e) {
      const std::uint8_t edge = triangulation.ring_edge[k][e];
      if (edge != Triangulation::kDiagonal) ring_halfedge[edge] = HalfEdgeMesh::halfedge(slot, e);
    }
    if (k > 0) {
      const auto& step = triangulation.step[k];
      mesh.link(HalfEdgeMesh::halfedge(slot, step.entry_edge),
                HalfEdgeMesh::halfedge(patch.slots[step.from_triangle], step.from_edge));
    }
  }
  for (unsigned k = triangulation.triangles; k < patch.slot_count; ++k) mesh.free_face(patch.slots[k]);
  attach_ring(mesh, patch, ring_halfedge, was_boundary);
  if (patch.is_border()) {
    mesh.link(ring_halfedge[patch.closing], kNone);
    mesh.set_outgoing(patch.ring[patch.closing], ring_halfedge[patch.closing]);
  }
  change_valences(mesh, patch, triangulation, -1);
  mesh.change_face_valence(patch.centre, -static_cast<int>(patch.star_faces()));
  mesh.set_outgoing(patch.centre, kNone);
}

void insert_centre(HalfEdgeMesh& mesh, Patch& patch, const Triangulation& triangulation, std::uint32_t centre) {
  const auto was_boundary = boundary_flags(mesh, patch);
  patch.centre = centre;
  while (patch.slot_count < patch.star_faces()) patch.slots[patch.slot_count++] = mesh.add_face();
  // Star face i: ring i, ring i + 1, centre. Its edge 0 is ring edge i, edge 1 the spoke in, edge 2 the spoke out.
  Halfedges ring_halfedge{};
  unsigned slot = 0;
  for (unsigned i = 0; i < patch.size; ++i) {
    if (i == patch.closing) continue;
    const std::uint32_t face = patch.slots[slot++];
    mesh.set_face(face, patch.ring[i], patch.ring[i + 1 < patch.size ? i + 1 : 0], centre);
    ring_halfedge[i] = HalfEdgeMesh::halfedge(face, 0);
  }
  for (unsigned i = 0; i < patch.size; ++i) {
    const unsigned after = i + 1 < patch.size ? i + 1 : 0;
    if (i == patch.closing) {
      mesh.link(ring_halfedge[after] + 2, kNone);  // centre -> a
    } else if (after == patch.closing) {
      mesh.link(ring_halfedge[i] + 1, kNone);  // b -> centre
    } else {
      mesh.link(ring_halfedge[i] + 1, ring_halfedge[after] + 2);
    }
  }
  attach_ring(mesh, patch, ring_halfedge, was_boundary);
  if (patch.is_border()) {
    const unsigned before = patch.closing == 0 ? patch.size - 1 : patch.closing - 1;
    mesh.set_outgoing(patch.ring[patch.closing], ring_halfedge[before] + 1);
    mesh.set_outgoing(centre, ring_halfedge[patch.closing + 1] + 2);
  } else {
    mesh.set_outgoing(centre, ring_halfedge[0] + 2);
  }
  change_valences(mesh, patch, triangulation, 1);
  mesh.change_face_valence(centre, static_cast<int>(patch.star_faces()));
}

}  // namespace pmcd::codec
