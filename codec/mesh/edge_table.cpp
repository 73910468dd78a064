// SPDX-License-Identifier: MIT
#include "codec/mesh/edge_table.h"

#include <algorithm>
#include <utility>

namespace pmcd::codec {

EdgeTable::EdgeTable(std::span<const Face> faces, std::size_t vertex_count) {
  const auto halfedges = static_cast<std::uint32_t>(3 * faces.size());
  auto for_each = [&](auto&& visit) {
    std::uint32_t h = 0;
    for (const Face& face : faces) {
      for (const auto& [a, b] : {std::pair{face[0], face[1]}, {face[1], face[2]}, {face[2], face[0]}}) {
        visit(h++, std::min(a, b), std::max(a, b));
      }
    }
  };
  // Half-edges by their smaller vertex, counting sort; then each vertex's few by the larger one.
  std::vector<std::uint32_t> bucket(vertex_count + 1, 0);
  for_each([&](std::uint32_t /*h*/, std::uint32_t low, std::uint32_t /*high*/) { ++bucket[low + 1]; });
  for (std::size_t v = 0; v < vertex_count; ++v) bucket[v + 1] += bucket[v];
  halfedge_.resize(halfedges);
  std::vector<std::uint32_t> cursor(bucket.begin(), bucket.end() - 1);
  for_each([&](std::uint32_t h, std::uint32_t low, std::uint32_t /*high*/) { halfedge_[cursor[low]++] = h; });
  start_.reserve(halfedges / 2 + 2);
  start_.push_back(0);
  std::vector<std::uint64_t> few;  // larger vertex, then half-edge
  for (std::uint32_t v = 0; v < vertex_count; ++v) {
    few.clear();
    for (std::uint32_t i = bucket[v]; i < bucket[v + 1]; ++i) {
      const std::uint32_t h = halfedge_[i];
      const Face& face = faces[h / 3];
      const std::uint32_t a = face[h % 3];
      const std::uint32_t high = a == v ? face[h % 3 == 2 ? 0 : h % 3 + 1] : a;
      few.push_back(std::uint64_t{high} << 32 | h);
    }
    std::sort(few.begin(), few.end());
    for (std::uint32_t i = 0; i < few.size(); ++i) {
      halfedge_[bucket[v] + i] = static_cast<std::uint32_t>(few[i]);
      if (i > 0 && few[i] >> 32 != few[i - 1] >> 32) start_.push_back(bucket[v] + i);
    }
    if (!few.empty()) start_.push_back(bucket[v + 1]);
  }
}

}  // namespace pmcd::codec
