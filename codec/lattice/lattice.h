// SPDX-License-Identifier: MIT
// The cubic lattice: float positions to integers and exactly back. Everything that steers decoding works on the
// integers; only here do they become coordinates. It does not store positions.
#pragma once

#include <array>
#include <cstdint>

#include "codec/mesh/triangle_mesh.h"
#include "codec/result.h"

namespace pmcd::codec {

using LatticePoint = std::array<std::int32_t, 3>;

inline constexpr unsigned kMinLatticeBits = 4;
inline constexpr unsigned kMaxLatticeBits = 24;

/// While a mesh is refined, points stand in half lattice steps, so that the middle of every cell is one: the cell of
/// 2^shift lattice points along each axis that holds a lattice point, the middle of a cell, and the cell of a middle.
inline LatticePoint cell_of(const LatticePoint& index, unsigned shift) {
  return {index[0] >> shift, index[1] >> shift, index[2] >> shift};
}
inline LatticePoint middle_of(const LatticePoint& cell, unsigned shift) {
  const std::int32_t half = (1 << shift) - 1;
  return {(cell[0] << (shift + 1)) + half, (cell[1] << (shift + 1)) + half, (cell[2] << (shift + 1)) + half};
}
inline LatticePoint cell_of_middle(const LatticePoint& middle, unsigned shift) {
  return cell_of(middle, shift + 1);
}

/// REQUIRES: bits in 4..24, step >= 0 and finite, min finite.
struct Lattice {
  Scalar scalar = Scalar::float32;
  unsigned bits = 12;
  Position min{0, 0, 0};  ///< lower corner of the bounding box
  double step = 0;        ///< largest extent / (2^bits - 1); 0 when all vertices lie in one point

  /// The lattice over the bounding box of the mesh's vertices. Error: non_finite_coordinate, extent_too_large,
  /// not_representable (a float32 mesh with a coordinate that float32 cannot hold).
  static Result<Lattice> over(const TriangleMesh& mesh, unsigned bits);

  /// Whether the fields hold together: what a packet claims is checked with this before use.
  [[nodiscard]] bool valid() const;

  [[nodiscard]] std::int32_t max_index() const { return static_cast<std::int32_t>((1u << bits) - 1); }

  /// Nearest lattice point, clamped to 0..max_index().
  [[nodiscard]] LatticePoint snap(const Position& p) const;
  [[nodiscard]] std::int32_t snap(double coordinate, int axis) const;

  /// min + index * step, computed in double in this order, then rounded to the scalar type.
  [[nodiscard]] Position position(const LatticePoint& p) const;
  /// The same of a point in half steps.
  [[nodiscard]] Position position_of_middle(const LatticePoint& middle) const;
};

}  // namespace pmcd::codec
