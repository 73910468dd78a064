// SPDX-License-Identifier: MIT
// How precisely a level's vertices stand: coarse levels on coarse lattices, so that their first packets are small; and
// whether the mesh repeats coordinates. The encoder's choices, which the stream states; no decoder asks.
#pragma once

#include <cstdint>
#include <span>

#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

/// How often edges lie along the lattice's planes, against chance.
enum class Alignment : std::uint8_t {
  none,   ///< as chance has it
  some,   ///< coordinates repeat: models that look for that save bits
  planes  ///< far more often: whole faces lie in planes, and coarse lattices would only blur them
};

/// [linear in the faces]
Alignment alignment_of(const TriangleMesh& mesh, std::span<const LatticePoint> points);

class PrecisionPlan {
 public:
  PrecisionPlan() = default;
  /// `points` are the mesh's vertices on the lattice. [linear in the faces]
  PrecisionPlan(const TriangleMesh& mesh, std::span<const LatticePoint> points, Alignment alignment);

  /// How many binary digits a level of `vertices` vertices leaves out: its cells are some fraction of its mean edge, a
  /// smaller one the nearer the level is to the whole mesh, where rounding would cost more than it saves.
  [[nodiscard]] unsigned shift_at(std::uint32_t vertices, unsigned bits) const;

 private:
  double area_ = 0;
  double vertices_ = 1;
  Alignment alignment_ = Alignment::none;
};

}  // namespace pmcd::codec
