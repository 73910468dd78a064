// SPDX-License-Identifier: GPL-3.0-or-later
// Welding by one sort, orientation by one flood.
#include "codec/import/repair.h"

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <numeric>

namespace pmcd::import {
namespace {

using codec::Face;
using codec::Position;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

std::array<std::uint64_t, 3> bits_of(const Position& p) {
  return {std::bit_cast<std::uint64_t>(p[0]), std::bit_cast<std::uint64_t>(p[1]), std::bit_cast<std::uint64_t>(p[2])};
}

}  // namespace

std::uint64_t weld_equal_bits(std::vector<Position>& positions, std::vector<std::uint64_t>& place,
                              std::span<std::uint32_t> corners) {
  std::vector<std::uint32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto bits_a = bits_of(positions[a]);
    const auto bits_b = bits_of(positions[b]);
    return bits_a != bits_b ? bits_a < bits_b : a < b;
  });
  // representative[v]: the first vertex with the bits of v.
  std::vector<std::uint32_t> representative(positions.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && bits_of(positions[order[i]]) == bits_of(positions[order[i - 1]]);
    representative[order[i]] = same ? representative[order[i - 1]] : order[i];
  }
  std::vector<std::uint32_t> renamed(positions.size());
  std::uint32_t kept = 0;
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    if (representative[v] == v) {
      renamed[v] = kept;
      positions[kept] = positions[v];
      if (v < place.size()) place[kept] = place[v];
      ++kept;
    } else {
      renamed[v] = renamed[representative[v]];
    }
  }
  for (std::uint32_t& corner : corners) corner = renamed[corner];
  const std::uint64_t gone = positions.size() - kept;
  positions.resize(kept);
  if (place.size() > kept) place.resize(kept);
  return gone;
}

Orientation orient(std::vector<Face>& faces, const codec::EdgeTable& edges) {
  // Across half-edge h: the half-edge of the face on the other side of its edge, none at a border.
  std::vector<std::uint32_t> across(3 * faces.size(), kNone);
  for (std::size_t e = 0; e < edges.edge_count(); ++e) {
    const std::span<const std::uint32_t> halfedges = edges.halfedges(e);
    if (halfedges.size() != 2) continue;
    across[halfedges[0]] = halfedges[1];
    across[halfedges[1]] = halfedges[0];
  }
  const auto from = [&](std::uint32_t h) { return faces[h / 3][h % 3]; };

  Orientation result;
  // Whether a face runs as the component's first one does.
  constexpr std::uint8_t kUnseen = 0;
  constexpr std::uint8_t kKeep = 1;
  constexpr std::uint8_t kTurn = 2;
  const auto opposite = [](std::uint8_t s) { return s == kKeep ? kTurn : kKeep; };
  std::vector<std::uint8_t> side(faces.size(), kUnseen);
  std::vector<std::uint32_t> component;  // faces of the component being flooded, in the order found
  std::vector<std::uint32_t> turned;
  for (std::uint32_t seed = 0; seed < faces.size(); ++seed) {
    if (side[seed] != kUnseen) continue;
    component.assign(1, seed);
    side[seed] = kKeep;
    std::size_t against_seed = 0;
    for (std::size_t next = 0; next < component.size(); ++next) {
      const std::uint32_t face = component[next];
      for (std::uint32_t h = 3 * face; h < 3 * face + 3; ++h) {
        if (across[h] == kNone) continue;
        const std::uint32_t other = across[h] / 3;
        const bool disagree = from(h) == from(across[h]);
        const std::uint8_t wanted = disagree ? opposite(side[face]) : side[face];
        if (side[other] == kUnseen) {
          side[other] = wanted;
          against_seed += wanted == kTurn ? 1 : 0;
          component.push_back(other);
        } else if (side[other] != wanted && h < across[h]) {
          ++result.conflicts;
          const std::uint32_t first = std::min(face, other);
          if (!result.conflict_face || first < *result.conflict_face) result.conflict_face = first;
        }
      }
    }
    const std::uint8_t minority = 2 * against_seed > component.size() ? kKeep : kTurn;
    const std::size_t before = turned.size();
    for (const std::uint32_t face : component) {
      if (side[face] == minority) turned.push_back(face);
    }
    result.components_touched += turned.size() > before ? 1 : 0;
  }
  if (result.conflicts > 0) {
    result.components_touched = 0;
    return result;
  }
  for (const std::uint32_t face : turned) std::swap(faces[face][1], faces[face][2]);
  result.faces_turned = turned.size();
  return result;
}

}  // namespace pmcd::import
