// SPDX-License-Identifier: GPL-3.0-or-later
// How far a level is from the original, and whether CGAL takes a mesh for a manifold one. Distances are geometric;
// whether two meshes are the same is compare.h's question.
#pragma once

#include <cstddef>
#include <vector>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

struct Distance {
  double rms = 0;
  double max = 0;
};

inline constexpr std::size_t kMostSamples = 20'000;

/// Distances from a mesh's vertices, at most kMostSamples of them taken with a fixed stride, to other surfaces,
/// relative to the diagonal of the mesh's own bounding box (absolute if that is a point).
class ErrorMeter {
 public:
  explicit ErrorMeter(const codec::TriangleMesh& original);

  /// The surface is the faces and the isolated vertices of `surface`. No vertices on either side: 0 if this has none,
  /// else infinity. REQUIRES: finite coordinates, indices in range. [O((n + samples) log n)]
  [[nodiscard]] Distance distance_to(const codec::TriangleMesh& surface) const;

  /// Of the original's bounding box.
  [[nodiscard]] double diagonal() const { return diagonal_; }
  [[nodiscard]] std::size_t samples() const { return samples_.size(); }

 private:
  std::vector<codec::Position> samples_;
  double diagonal_ = 0;
};

/// True if CGAL takes the faces for an oriented manifold polygon mesh, with or without boundary. For tests.
bool is_valid_cgal(const codec::TriangleMesh& mesh);

}  // namespace pmcd::import
