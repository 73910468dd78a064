// SPDX-License-Identifier: MIT
#include "codec/lattice/cell.h"

#include <algorithm>
#include <limits>

namespace pmcd::codec {
namespace {

// The first ordered float from an edge on, between the smallest finite one and the one after the largest.
std::int64_t first_float(double edge, Scalar scalar) {
  const double most =
      scalar == Scalar::float32 ? std::numeric_limits<float>::max() : std::numeric_limits<double>::max();
  if (!(edge > -most)) return to_ordered(-most, scalar);
  if (edge > most) return to_ordered(most, scalar) + 1;
  double value = round_to(scalar, edge);
  const std::int64_t ordered = to_ordered(value, scalar);
  if (value < edge) return ordered + 1;
  return value == 0 ? to_ordered(-0.0, scalar) : ordered;
}

}  // namespace

bool valid(const SteppedGrid& grid) {
  for (double value : grid.origin) {
    if (!std::isfinite(value)) return false;
  }
  return std::isfinite(grid.step) && grid.step > 0;
}

double Cell::on_grid(std::int64_t n) const {
  const double point = grid->origin[axis] + static_cast<double>(n) * grid->step;
  if (decimals == nullptr) return round_to(scalar, point);
  const std::int64_t above = first_from(*decimals, point);
  const double high = value_of(*decimals, above);
  const double low = value_of(*decimals, above - 1);
  return round_to(scalar, point - low < high - point ? low : high);
}

std::uint64_t Cell::nearest(double coordinate) const {
  if (grid != nullptr) {
    const std::int64_t n = whole_below((coordinate - grid->origin[axis]) / grid->step + 0.5);
    return n <= first ? 0 : std::min(static_cast<std::uint64_t>(n - first), count - 1);
  }
  if (decimals == nullptr) {
    const std::int64_t ordered = to_ordered(coordinate, scalar);
    if (ordered <= first) return 0;
    return std::min(static_cast<std::uint64_t>(ordered) - static_cast<std::uint64_t>(first), count - 1);
  }
  const std::int64_t above = first_from(*decimals, coordinate);
  const auto limited = [&](std::int64_t number) {
    return number <= first ? 0 : std::min(static_cast<std::uint64_t>(number - first), count - 1);
  };
  // The number above was found with a rounding: look at its neighbours too.
  std::uint64_t best = limited(above);
  double least = std::abs(value(best) - coordinate);
  for (std::int64_t number = above - 2; number <= above + 1; ++number) {
    const std::uint64_t other = limited(number);
    if (other == best) continue;
    const double away = std::abs(value(other) - coordinate);
    if (!(away < least)) continue;
    best = other;
    least = away;
  }
  return best;
}

Cell cell_of(const Lattice& lattice, std::int32_t index, std::size_t axis, const Decimals* decimals) {
  const double lower = lattice.edge(index, axis);
  const double upper = lattice.edge(index + 1, axis);
  Cell cell;
  cell.decimals = decimals;
  cell.scalar = lattice.scalar;
  cell.first = decimals != nullptr ? first_from(*decimals, lower) : first_float(lower, lattice.scalar);
  const std::int64_t end = decimals != nullptr ? first_from(*decimals, upper) : first_float(upper, lattice.scalar);
  if (end > cell.first) cell.count = static_cast<std::uint64_t>(end) - static_cast<std::uint64_t>(cell.first);
  return cell;
}

Cell grid_cell_of(const Lattice& lattice, std::int32_t index, std::size_t axis, const SteppedGrid& grid,
                  const Decimals* decimals) {
  Cell cell;
  cell.decimals = decimals;
  cell.scalar = lattice.scalar;
  cell.grid = &grid;
  cell.axis = axis;
  cell.first = whole_above((lattice.edge(index, axis) - grid.origin[axis]) / grid.step);
  const std::int64_t end = whole_above((lattice.edge(index + 1, axis) - grid.origin[axis]) / grid.step);
  if (end > cell.first) cell.count = static_cast<std::uint64_t>(end - cell.first);
  return cell;
}

}  // namespace pmcd::codec
