// SPDX-License-Identifier: MIT
#include "codec/mesh/edge_table.h"

#include <algorithm>

namespace pmcd::codec {

EdgeTable::EdgeTable(std::span<const Face> faces, std::size_t vertex_count) {
  const auto halfedges = static_cast<std::uint32_t>(3 * faces.size());
  auto ends = [&](std::uint32_t h) {
    const Face& face = faces[h / 3];
    const std::uint32_t a = face[h % 3];
    const std::uint32_t b = face[(h + 1) % 3];
    return a < b ? std::pair{a, b} : std::pair{b, a};
  };
  // Half-edges by their smaller vertex, counting sort; then each vertex's few by the larger one.
  std::vector<std::uint32_t> bucket(vertex_count + 1, 0);
  for (std::uint32_t h = 0; h < halfedges; ++h) ++bucket[ends(h).first + 1];
  for (std::size_t v = 0; v < vertex_count; ++v) bucket[v + 1] += bucket[v];
  halfedge_.resize(halfedges);
  std::vector<std::uint32_t> cursor(bucket.begin(), bucket.end() - 1);
  for (std::uint32_t h = 0; h < halfedges; ++h) halfedge_[cursor[ends(h).first]++] = h;
  start_.reserve(halfedges / 2 + 2);
  start_.push_back(0);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const auto first = halfedge_.begin() + bucket[v];
    const auto last = halfedge_.begin() + bucket[v + 1];
    std::sort(first, last, [&](std::uint32_t a, std::uint32_t b) {
      const std::uint32_t to_a = ends(a).second;
      const std::uint32_t to_b = ends(b).second;
      return to_a != to_b ? to_a < to_b : a < b;
    });
    for (std::uint32_t i = bucket[v] + 1; i < bucket[v + 1]; ++i) {
      if (ends(halfedge_[i]).second != ends(halfedge_[i - 1]).second) start_.push_back(i);
    }
    if (bucket[v + 1] > bucket[v]) start_.push_back(bucket[v + 1]);
  }
}

}  // namespace pmcd::codec
