// SPDX-License-Identifier: GPL-3.0-or-later
// What makes a triangle mesh unfit for the codec, found, counted and placed; nothing is changed. Orientation is not
// looked at (repair.h does).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/import/error.h"
#include "codec/mesh/edge_table.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct Defect {
  ImportErrorCode code = ImportErrorCode::malformed;
  std::uint64_t count = 0;
  std::uint32_t first = 0;  ///< face; for non_manifold_vertex a vertex
};

/// Duplicate faces, edges with more than two faces, vertices with more than one fan of faces; in this order, each kind
/// at most once. REQUIRES: `edges` is of `faces`. [O(n log n) for the duplicates, else linear]
std::vector<Defect> find_defects(std::span<const codec::Face> faces, std::size_t vertex_count,
                                 const codec::EdgeTable& edges);

}  // namespace pmcd::import
