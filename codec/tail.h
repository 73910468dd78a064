// SPDX-License-Identifier: MIT
// What a packet may bring after its mesh: the isolated vertices, and the exactness that lifts lattice positions to the
// original coordinates. Both directions in one text, as in refine.h.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "codec/lattice/ordered_float.h"
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

/// 64-bit numbers, all equally likely: the leading bits as one uniform number, the rest raw.
template <typename Source>
std::uint64_t code_uniform64(Source& source, std::uint64_t value, std::uint64_t count) {
  constexpr unsigned kLeading = 23;
  const auto width = static_cast<unsigned>(std::bit_width(count - 1));
  const unsigned low = width > kLeading ? width - kLeading : 0;
  const auto leading_count = static_cast<std::uint32_t>(((count - 1) >> low) + 1);
  std::uint64_t result = source.uniform(static_cast<std::uint32_t>(value >> low), leading_count);
  for (unsigned left = low; left > 0;) {
    const unsigned bits = std::min(left, 32u);
    left -= bits;
    const auto part = static_cast<std::uint32_t>((value >> left) & (~std::uint64_t{0} >> (64 - bits)));
    result = (result << bits) | source.raw(part, bits);
  }
  return result;
}

/// Every vertex's exact coordinates: the number of the float within those that snap to its lattice index.
/// Errors: corrupt_data.
template <typename Source>
Status code_exactness(LevelState& state, Source& source) {
  const bool any = source.raw(source.wanted_exactness() ? 1 : 0, 1) != 0;
  if (!any) return {};
  const Scalar scalar = state.lattice.scalar;
  const Error corrupt{ErrorCode::corrupt_data, 0, "the exactness section contradicts the lattice"};
  if (!state.lossless || !state.exact.empty()) return corrupt;
  std::array<OrderedRange, 3> bounds;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    auto code_bound = [&](bool upper) {
      const auto wanted = std::bit_cast<std::uint64_t>(source.wanted_bound(axis, upper));
      const std::uint64_t high = source.raw(static_cast<std::uint32_t>(wanted >> 32), 32);
      return std::bit_cast<double>(high << 32 | source.raw(static_cast<std::uint32_t>(wanted & 0xFFFFFFFFu), 32));
    };
    const double lower = code_bound(false);
    const double upper = code_bound(true);
    if (!std::isfinite(lower) || !std::isfinite(upper)) return corrupt;
    if (scalar == Scalar::float32 && (static_cast<double>(static_cast<float>(lower)) != lower ||
                                      static_cast<double>(static_cast<float>(upper)) != upper)) {
      return corrupt;
    }
    bounds[axis] = {to_ordered(lower, scalar), to_ordered(upper, scalar)};
    if (bounds[axis].first > bounds[axis].last) return corrupt;
  }
  state.exact.reserve(state.points.size());
  for (std::uint32_t v = 0; v < state.points.size(); ++v) {
    Position position{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const OrderedRange run =
          floats_in_cell(state.lattice, static_cast<int>(axis), state.points[v][axis] / 2, bounds[axis]);
      if (source.failed() || run.last < run.first) return corrupt;
      const std::uint64_t count = static_cast<std::uint64_t>(run.last) - static_cast<std::uint64_t>(run.first) + 1;
      const std::uint64_t wanted = static_cast<std::uint64_t>(to_ordered(source.wanted_exact(v, axis), scalar)) -
                                   static_cast<std::uint64_t>(run.first);
      const std::uint64_t number = code_uniform64(source, wanted, count);
      if (number >= count) return corrupt;
      const std::uint64_t ordered = static_cast<std::uint64_t>(run.first) + number;
      position[axis] = from_ordered(static_cast<std::int64_t>(ordered), scalar);
    }
    state.exact.push_back(position);
  }
  source.told_part(PacketPart::exactness);
  return {};
}

}  // namespace pmcd::codec
