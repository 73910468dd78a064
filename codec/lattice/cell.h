// SPDX-License-Identifier: MIT
// The numbers that snap to one index of a lattice along one axis: all floats of its cell, or the decimals in it. A
// lattice position is lifted to the exact coordinate by the coordinate's number among them.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "codec/lattice/decimals.h"
#include "codec/lattice/exactness_form.h"
#include "codec/lattice/lattice.h"
#include "codec/lattice/ordered_float.h"

namespace pmcd::codec {

/// Consecutive numbers, of decimals, of ordered floats, or of a grid's points.
struct Cell {
  const Decimals* decimals = nullptr;  ///< null: floats
  Scalar scalar = Scalar::float32;
  std::int64_t first = 0;
  std::uint64_t count = 0;
  const SteppedGrid* grid = nullptr;  ///< its points, moved to the nearest of `decimals` or floats
  std::size_t axis = 0;

  /// The coordinate with number `first + number`; infinite only for decimals beyond the scalar type.
  /// REQUIRES: number < count.
  [[nodiscard]] double value(std::uint64_t number) const {
    const auto n = static_cast<std::int64_t>(static_cast<std::uint64_t>(first) + number);
    if (grid != nullptr) return on_grid(n);
    return decimals != nullptr ? round_to(scalar, value_of(*decimals, n)) : from_ordered(n, scalar);
  }

  /// The number, less `first`, of what is nearest to `coordinate` within the cell. REQUIRES: count > 0.
  [[nodiscard]] std::uint64_t nearest(double coordinate) const;

 private:
  [[nodiscard]] double on_grid(std::int64_t n) const;
};

/// What lies from the edge of `index` to the next edge, the lower one included: decimals, or all floats for null.
/// REQUIRES: lattice.valid(), 0 <= index <= max_index(), valid(*decimals). [a few operations; a loop over decades]
Cell cell_of(const Lattice& lattice, std::int32_t index, std::size_t axis, const Decimals* decimals);

/// The same of the points of a grid. REQUIRES: valid(grid).
Cell grid_cell_of(const Lattice& lattice, std::int32_t index, std::size_t axis, const SteppedGrid& grid,
                  const Decimals* decimals);

}  // namespace pmcd::codec
