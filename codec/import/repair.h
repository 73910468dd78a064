// SPDX-License-Identifier: GPL-3.0-or-later
// The two repairs that import may make on an indexed mesh: weld the corners of an STL file, and turn faces so that
// neighbours agree. Neither moves a vertex or adds or drops a face.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/mesh/edge_table.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

/// Makes vertices of equal position bits (-0.0 and +0.0 differ) one; they keep the order of their first appearance.
/// Renames `corners`; answers the number of vertices that went. [O(n log n)]
std::uint64_t weld_equal_bits(std::vector<codec::Position>& positions, std::vector<std::uint64_t>& place,
                              std::span<std::uint32_t> corners);

struct Orientation {
  std::uint64_t faces_turned = 0;
  std::uint64_t components_touched = 0;
  std::uint64_t conflicts = 0;                 ///< edges whose faces cannot be made to agree; 0: orientable
  std::optional<std::uint32_t> conflict_face;  ///< a face at the first of them
};

/// Turns the fewest faces so that the two faces at each edge agree, component by component; on a tie the component's
/// first face stays. With conflicts nothing is turned. REQUIRES: `edges` is of `faces`; no edge has more than two
/// faces. [O(n)]
Orientation orient(std::vector<codec::Face>& faces, const codec::EdgeTable& edges);

}  // namespace pmcd::import
