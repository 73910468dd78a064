// SPDX-License-Identifier: GPL-3.0-or-later
// The hard part of comparing: matching vertices that share their position. Colours are refined until equal colours mean
// equal surroundings, and where that leaves a choice, candidates are tried. It knows no coordinates.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

/// Two meshes whose vertices fall into classes; only vertices of one class may be matched.
struct MatchingProblem {
  std::span<const codec::Face> faces_a;
  std::span<const codec::Face> faces_b;
  std::vector<std::uint32_t> class_a;  ///< of each vertex, from 0 to classes - 1
  std::vector<std::uint32_t> class_b;
  std::uint32_t classes = 0;
};

struct Matching {
  bool found = false;
  std::vector<std::uint32_t> image;      ///< if found: the vertex of B for each vertex of A
  std::optional<std::uint32_t> stuck_a;  ///< if not: a vertex of A without counterpart, or else
  std::optional<std::uint32_t> stuck_b;  ///< one of B
};

/// REQUIRES: each class has as many vertices in A as in B. The image maps every face onto a face; that the faces'
/// multiplicities agree is for the caller to check.
Matching match_vertices(const MatchingProblem& problem);

}  // namespace pmcd::import
