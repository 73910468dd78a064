// SPDX-License-Identifier: MIT
// All half-edges of an indexed mesh grouped by undirected edge, in flat arrays: one counting sort, no hash map. Says
// how many faces meet at each edge and which way they run; decides nothing about it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

/// Corner c of face f starts half-edge 3 * f + c, which runs from face[c] to face[(c + 1) % 3].
class EdgeTable {
 public:
  /// REQUIRES: every index < vertex_count, 3 * faces.size() < 2^32, no face names a vertex twice. Time: linear, apart
  /// from sorting the few half-edges at each vertex. Memory: 8 bytes a half-edge plus 4 a vertex.
  EdgeTable(std::span<const Face> faces, std::size_t vertex_count);

  [[nodiscard]] std::size_t edge_count() const { return start_.size() - 1; }
  /// Half-edges of edge e, both directions, in ascending order of half-edge.
  [[nodiscard]] std::span<const std::uint32_t> halfedges(std::size_t e) const {
    return {halfedge_.data() + start_[e], halfedge_.data() + start_[e + 1]};
  }

 private:
  std::vector<std::uint32_t> halfedge_;
  std::vector<std::uint32_t> start_;
};

}  // namespace pmcd::codec
