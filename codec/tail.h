// SPDX-License-Identifier: MIT
// What a packet may bring after its mesh: the isolated vertices. (The exactness that may follow them is exactness.h.)
// Both directions in one text, as in refine.h.
#pragma once

#include "codec/level_state.h"
#include "codec/result.h"
#include "codec/source.h"

namespace pmcd::codec {

/// Vertices in no face, in the order in which the encoder sorted them: steps from one to the next.
/// Errors: corrupt_data.
template <typename Source>
Status code_isolated(LevelState& state, std::uint32_t max_vertices, Source& source) {
  const std::uint32_t have = state.mesh.vertex_count();
  const bool any = source.raw(source.wanted_isolated() > 0 ? 1 : 0, 1) != 0;
  if (!any) return {};
  const std::uint32_t count = source.raw(source.wanted_isolated(), 32);
  if (count > max_vertices - have) return Error{ErrorCode::corrupt_data, have, "more isolated vertices than promised"};
  const std::int32_t most = state.lattice.max_index();
  LatticePoint previous{most / 2, most / 2, most / 2};
  for (std::uint32_t k = 0; k < count; ++k) {
    const LatticePoint wanted = source.wanted_isolated_point(k);
    LatticePoint point{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t value =
          std::int64_t{previous[axis]} + state.models.isolated[axis].code(source, wanted[axis] - previous[axis]);
      if (source.failed() || value < 0 || value > most) {
        return Error{ErrorCode::corrupt_data, have + k, "an isolated vertex leaves the lattice"};
      }
      point[axis] = static_cast<std::int32_t>(value);
    }
    const std::uint32_t vertex = state.mesh.add_vertex();
    state.points.push_back(middle_of(point, 0));
    source.told_isolated(k, vertex);
    previous = point;
  }
  state.spreads.resize(state.mesh.vertex_count());
  source.told_part(PacketPart::isolated);
  return {};
}

}  // namespace pmcd::codec
