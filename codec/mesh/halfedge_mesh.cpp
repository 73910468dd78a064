// SPDX-License-Identifier: MIT
#include "codec/mesh/halfedge_mesh.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "codec/mesh/edge_table.h"

namespace pmcd::codec {
namespace {

std::string edge_text(std::uint32_t a, std::uint32_t b) {
  return "the edge of vertices " + std::to_string(a) + " and " + std::to_string(b);
}

Status check_indices(std::span<const Face> faces, std::size_t vertex_count) {
  if (faces.size() > kMaxFaces || vertex_count >= kNone) {
    return Error{ErrorCode::mesh_too_large, 0, "a mesh may have at most 1 billion faces and 4.2 billion vertices"};
  }
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Face& face = faces[f];
    for (std::uint32_t v : face) {
      if (v >= vertex_count) {
        return Error{
            ErrorCode::index_out_of_range, f,
            "face " + std::to_string(f) + " names vertex " + std::to_string(v) + " of " + std::to_string(vertex_count)};
      }
    }
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      return Error{ErrorCode::repeated_index_in_face, f, "face " + std::to_string(f) + " names a vertex twice"};
    }
  }
  return {};
}

bool same_vertices(const Face& a, const Face& b) {
  for (std::uint32_t v : a) {
    if (v != b[0] && v != b[1] && v != b[2]) return false;
  }
  return true;
}

// The first two faces at an edge that have the same vertices. At an edge of very many faces only the first are looked
// at: then the edge is what is named.
std::optional<std::pair<std::uint32_t, std::uint32_t>> same_faces(std::span<const Face> faces,
                                                                  std::span<const std::uint32_t> halfedges) {
  constexpr std::size_t kLookedAt = 16;
  for (std::size_t j = 1; j < halfedges.size() && j < kLookedAt; ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      if (same_vertices(faces[halfedges[i] / 3], faces[halfedges[j] / 3]))
        return {{halfedges[i] / 3, halfedges[j] / 3}};
    }
  }
  return std::nullopt;
}

}  // namespace

Result<HalfEdgeMesh> HalfEdgeMesh::build(std::span<const Face> faces, std::size_t vertex_count) {
  Status indices = check_indices(faces, vertex_count);
  if (!indices) return indices.error();

  HalfEdgeMesh mesh;
  mesh.halfedge_.reserve(4 * faces.size());
  mesh.face_valence_.assign(vertex_count, 0);
  for (const Face& face : faces) {
    for (std::uint32_t v : face) {
      mesh.halfedge_.push_back({v, kNone});
      ++mesh.face_valence_[v];
    }
    mesh.halfedge_.push_back({face[0], kNone});
  }
  {
    const EdgeTable edges(faces, vertex_count);
    for (std::size_t e = 0; e < edges.edge_count(); ++e) {
      const auto halfedges = edges.halfedges(e);
      if (halfedges.size() == 1) continue;
      auto named = [](std::uint32_t h) { return halfedge(h / 3, h % 3); };  // the table has three a face
      const std::uint32_t a = named(halfedges[0]);
      const std::uint32_t b = named(halfedges[1]);
      const bool plain = halfedges.size() == 2 && mesh.apex(a) != mesh.apex(b);  // so not the same face twice
      if (const auto twins = plain ? std::nullopt : same_faces(faces, halfedges)) {
        return Error{ErrorCode::duplicate_face, twins->second,
                     "faces " + std::to_string(twins->first) + " and " + std::to_string(twins->second) +
                         " have the same vertices"};
      }
      if (halfedges.size() > 2) {
        return Error{ErrorCode::non_manifold_edge, halfedges[2] / 3,
                     std::to_string(halfedges.size()) + " faces meet at " + edge_text(mesh.origin(a), mesh.target(a))};
      }
      if (mesh.origin(a) == mesh.origin(b)) {
        return Error{ErrorCode::opposing_faces, face_of(b),
                     "faces " + std::to_string(face_of(a)) + " and " + std::to_string(face_of(b)) +
                         " are turned against each other at " + edge_text(mesh.origin(a), mesh.target(a))};
      }
      mesh.link(a, b);
    }
  }
  mesh.outgoing_.assign(vertex_count, kNone);
  for (std::uint32_t h = 0; h < mesh.halfedge_.size(); ++h) {
    if (edge_of(h) == 3) continue;
    std::uint32_t& outgoing = mesh.outgoing_[mesh.origin(h)];
    if (outgoing == kNone || mesh.opposite(h) == kNone) outgoing = h;
  }
  // One fan a vertex: turning left from its outgoing half-edge must meet all its faces.
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    const std::uint32_t first = mesh.outgoing_[v];
    if (first == kNone) continue;
    std::uint32_t met = 0;
    std::uint32_t h = first;
    do {
      ++met;
      h = mesh.turn_left(h);
    } while (h != kNone && h != first);
    if (met != mesh.face_valence_[v]) {
      return Error{ErrorCode::non_manifold_vertex, v,
                   "the faces at vertex " + std::to_string(v) + " form more than one fan"};
    }
  }
  return mesh;
}

bool HalfEdgeMesh::has_edge(std::uint32_t a, std::uint32_t b) const {
  if (face_valence_[a] > face_valence_[b]) std::swap(a, b);
  const std::uint32_t first = outgoing_[a];
  if (first == kNone) return false;
  std::uint32_t h = first;
  for (;;) {
    if (target(h) == b) return true;
    const std::uint32_t left = turn_left(h);
    if (left == first) return false;
    if (left == kNone) return apex(h) == b;
    h = left;
  }
}

std::uint32_t HalfEdgeMesh::find_halfedge(std::uint32_t a, std::uint32_t b) const {
  const std::uint32_t first = outgoing_[a];
  if (first == kNone) return kNone;
  std::uint32_t h = first;
  do {
    if (target(h) == b) return h;
    h = turn_left(h);
  } while (h != kNone && h != first);
  return kNone;
}

void HalfEdgeMesh::reserve(std::uint32_t vertices, std::uint32_t faces) {
  halfedge_.reserve(4 * std::size_t{faces});
  outgoing_.reserve(vertices);
  face_valence_.reserve(vertices);
}

void HalfEdgeMesh::reorder(std::span<const std::uint32_t> order) {
  std::vector<std::uint32_t> place(face_count(), kNone);
  for (std::uint32_t i = 0; i < order.size(); ++i) place[order[i]] = i;
  auto moved = [&](std::uint32_t h) { return h == kNone ? kNone : halfedge(place[face_of(h)], edge_of(h)); };
  // Into a copy: moving cycle by cycle in place would wait for memory at each step.
  std::vector<HalfEdge> ordered;
  ordered.reserve(order.size() == face_count() ? halfedge_.capacity() : 4 * order.size());
  constexpr std::size_t kAhead = 8;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + kAhead < order.size()) foresee(halfedge(order[i + kAhead], 0));
    for (std::uint32_t edge = 0; edge < 4; ++edge) {
      HalfEdge h = halfedge_[halfedge(order[i], edge)];
      h.opposite = moved(h.opposite);
      ordered.push_back(h);
    }
  }
  halfedge_ = std::move(ordered);
  for (std::uint32_t& h : outgoing_) h = moved(h);
}

std::uint32_t HalfEdgeMesh::add_vertex() {
  outgoing_.push_back(kNone);
  face_valence_.push_back(0);
  return vertex_count() - 1;
}

std::uint32_t HalfEdgeMesh::add_face() {
  halfedge_.resize(halfedge_.size() + 4);
  return face_count() - 1;
}

}  // namespace pmcd::codec
