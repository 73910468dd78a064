// SPDX-License-Identifier: GPL-3.0-or-later
// The same mesh up to numbering: is there a bijection of the vertices that keeps every position's bits (-0.0 and +0.0
// differ; float32 and double compare by value) and maps the cyclic corner triples of one mesh onto the other's, with
// multiplicity? Right with vertices at the same position, too. Knows no distances.
#pragma once

#include <string>
#include <vector>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct Comparison {
  bool same = false;
  /// If not same: the first differences, a line each, at most a dozen.
  std::vector<std::string> differences;
};

/// Compares `a` with `b`; they are called by these names in the differences. REQUIRES: indices in range.
/// Time: that of sorting. Where whole components lie on top of each other, candidates are tried component by component;
/// only meshes that are not manifold and made for it take long.
Comparison compare_meshes(const codec::TriangleMesh& a, const codec::TriangleMesh& b, const std::string& name_a = "A",
                          const std::string& name_b = "B");

}  // namespace pmcd::import
