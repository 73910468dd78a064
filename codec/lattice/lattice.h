// SPDX-License-Identifier: MIT
// The cubic lattice: float positions to integers and exactly back. Everything that steers decoding works on the
// integers; only here do they become coordinates. It does not store positions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "codec/lattice/unit.h"
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

/// The nearest number of the scalar type; may be infinite.
double round_to(Scalar scalar, double value);

/// REQUIRES: bits in 4..24, step >= 0 and finite, min finite.
struct Lattice {
  Scalar scalar = Scalar::float32;
  unsigned bits = 12;
  Position min{0, 0, 0};  ///< lower corner of the bounding box; with a unit: origin * unit
  double step = 0;  ///< largest extent / (2^bits - 1); 0 when all vertices lie in one point; with a unit: the unit

  /// Set: the coordinates are whole multiples of it, and index i means (origin + i) * unit.
  std::optional<Unit> unit;
  std::array<std::int64_t, 3> origin{};  ///< in units; only with a unit
  /// Every coordinate of the mesh is the position of its index, bit for bit; only with a unit.
  bool exact = false;

  /// The lattice over the bounding box of the mesh's vertices. Error: non_finite_coordinate, extent_too_large,
  /// not_representable (a float32 mesh with a coordinate that float32 cannot hold).
  static Result<Lattice> over(const TriangleMesh& mesh, unsigned bits);

  /// The lattice of the unit's multiples over the bounding box, with as many bits as that takes; nothing if it takes
  /// more than 24 or numbers beyond kMaxWhole. REQUIRES: a mesh that over() takes, with a vertex; valid(unit).
  static std::optional<Lattice> of_multiples(const TriangleMesh& mesh, const Unit& unit);

  /// Sets unit and origin, and min and step by them. REQUIRES: valid(unit), each |origin| <= kMaxWhole.
  void set_unit(const Unit& multiples_of, const std::array<std::int64_t, 3>& from);

  /// Whether the fields hold together: what a packet claims is checked with this before use.
  [[nodiscard]] bool valid() const;

  [[nodiscard]] std::int32_t max_index() const { return static_cast<std::int32_t>((1u << bits) - 1); }

  /// Nearest lattice point, clamped to 0..max_index().
  [[nodiscard]] LatticePoint snap(const Position& p) const;
  [[nodiscard]] std::int32_t snap(double coordinate, int axis) const;

  /// min + index * step, or (origin + index) * unit by multiple_of(), computed in double in this order, then rounded to
  /// the scalar type.
  [[nodiscard]] Position position(const LatticePoint& p) const;
  /// The same of a point in half steps; of the middle between two multiples of a unit, the mean of these.
  [[nodiscard]] Position position_of_middle(const LatticePoint& middle) const;

  /// Where the cell of an index begins: half a step below its position, min + (index - 0.5) * step. The coordinates
  /// that snap to an index lie from its edge to the next one's, up to a rounding.
  [[nodiscard]] double edge(std::int32_t index, std::size_t axis) const { return min[axis] + (index - 0.5) * step; }
};

}  // namespace pmcd::codec
