// SPDX-License-Identifier: GPL-3.0-or-later
// Duplicates by sorting, edges by counting, fans by joining the corners at a vertex across edges.
#include "codec/import/defects.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace pmcd::import {
namespace {

using codec::Face;

Defect duplicate_faces(std::span<const Face> faces) {
  struct Entry {
    Face sorted;
    std::uint32_t face;
  };
  std::vector<Entry> entries(faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    entries[f] = {faces[f], f};
    std::sort(entries[f].sorted.begin(), entries[f].sorted.end());
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.sorted != b.sorted ? a.sorted < b.sorted : a.face < b.face;
  });
  Defect defect{ImportErrorCode::duplicate_face, 0, std::numeric_limits<std::uint32_t>::max()};
  for (std::size_t i = 1; i < entries.size(); ++i) {
    if (entries[i].sorted != entries[i - 1].sorted) continue;
    ++defect.count;
    defect.first = std::min(defect.first, entries[i].face);
  }
  return defect;
}

Defect crowded_edges(const codec::EdgeTable& edges) {
  Defect defect{ImportErrorCode::non_manifold_edge, 0, std::numeric_limits<std::uint32_t>::max()};
  for (std::size_t e = 0; e < edges.edge_count(); ++e) {
    const std::span<const std::uint32_t> halfedges = edges.halfedges(e);
    if (halfedges.size() <= 2) continue;
    ++defect.count;
    defect.first = std::min(defect.first, halfedges.front() / 3);
  }
  return defect;
}

/// Corners that are joined across edges form the fans of a vertex.
Defect split_vertices(std::span<const Face> faces, std::size_t vertex_count, const codec::EdgeTable& edges) {
  std::vector<std::uint32_t> parent(3 * faces.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t corner) {
    while (parent[corner] != corner) corner = parent[corner] = parent[parent[corner]];
    return corner;
  };
  const auto vertex = [&](std::uint32_t corner) { return faces[corner / 3][corner % 3]; };
  const auto end_of = [](std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; };
  for (std::size_t e = 0; e < edges.edge_count(); ++e) {
    const std::span<const std::uint32_t> halfedges = edges.halfedges(e);
    for (std::size_t i = 1; i < halfedges.size(); ++i) {
      const std::uint32_t a = halfedges[0];
      const std::uint32_t b = halfedges[i];
      const bool same_way = vertex(a) == vertex(b);
      parent[root(a)] = root(same_way ? b : end_of(b));
      parent[root(end_of(a))] = root(same_way ? end_of(b) : b);
    }
  }
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> fan(vertex_count, kNone);
  std::vector<bool> counted(vertex_count, false);
  Defect defect{ImportErrorCode::non_manifold_vertex, 0, kNone};
  for (std::uint32_t corner = 0; corner < parent.size(); ++corner) {
    const std::uint32_t v = vertex(corner);
    const std::uint32_t found = root(corner);
    if (fan[v] == kNone) fan[v] = found;
    if (fan[v] == found || counted[v]) continue;
    counted[v] = true;
    ++defect.count;
    defect.first = std::min(defect.first, v);
  }
  return defect;
}

}  // namespace

std::vector<Defect> find_defects(std::span<const Face> faces, std::size_t vertex_count, const codec::EdgeTable& edges) {
  std::vector<Defect> defects;
  for (const Defect& defect :
       {duplicate_faces(faces), crowded_edges(edges), split_vertices(faces, vertex_count, edges)}) {
    if (defect.count > 0) defects.push_back(defect);
  }
  return defects;
}

}  // namespace pmcd::import
