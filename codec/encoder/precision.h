// SPDX-License-Identifier: MIT
// How precisely a level's vertices stand: coarse levels on coarse lattices, so that their first packets are small; and
// whether the mesh is one that repeats coordinates. The encoder's choices, which the stream states; no decoder asks.
#pragma once

#include <cstdint>
#include <span>

#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

class PrecisionPlan {
 public:
  /// `points` are the mesh's vertices on the lattice. [linear in the faces]
  PrecisionPlan(const TriangleMesh& mesh, std::span<const LatticePoint> points);

  /// How many binary digits a level of `vertices` vertices leaves out: its cells are some fraction of its mean edge, a
  /// smaller one the nearer the level is to the whole mesh, where rounding would cost more than it saves.
  [[nodiscard]] unsigned shift_at(std::uint32_t vertices, unsigned bits) const;

 private:
  double area_ = 0;
  double vertices_ = 1;
};

/// Whether edges lie along the axes far more often than chance has it: then coordinates repeat, and models that look
/// for that pay for their time. [linear in the faces]
bool repeats_coordinates(const TriangleMesh& mesh, std::span<const LatticePoint> points);

}  // namespace pmcd::codec
