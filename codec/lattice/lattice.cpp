// SPDX-License-Identifier: MIT
#include "codec/lattice/lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace pmcd::codec {
namespace {

// Sums and differences of two coordinates below this stay finite; above it no mesh is meant.
constexpr double kLargestCoordinate = std::numeric_limits<double>::max() / 8;

// The nearest float32. Not inlined for a reason: g++ 12 at -O3 vectorises a loop over (double)(float)x and forgets to
// round (LatticeTest.PositionsAreRoundedToFloat32 sees it), and a position that is not rounded is another mesh.
[[gnu::noinline]] double to_float32(double value) {
  return static_cast<double>(static_cast<float>(value));
}

// The whole number of units next to a coordinate.
std::int64_t nearest_whole(const Unit& unit, double value) {
  return whole_below(in_units(unit, value) + 0.5);
}

}  // namespace

double round_to(Scalar scalar, double value) {
  return scalar == Scalar::float32 ? to_float32(value) : value;
}

Result<Lattice> Lattice::over(const TriangleMesh& mesh, unsigned bits) {
  Lattice lattice;
  lattice.scalar = mesh.scalar;
  lattice.bits = bits;
  if (mesh.positions.empty()) return lattice;
  Position low = mesh.positions[0];
  Position high = low;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = mesh.positions[v][axis];
      if (!std::isfinite(value)) {
        return Error{ErrorCode::non_finite_coordinate, v,
                     "vertex " + std::to_string(v) + " has a coordinate that is not a finite number"};
      }
      if (std::abs(value) > kLargestCoordinate) {
        return Error{ErrorCode::extent_too_large, axis, "vertex " + std::to_string(v) + " lies beyond 2e307"};
      }
      if (mesh.scalar == Scalar::float32 && to_float32(value) != value) {
        return Error{ErrorCode::not_representable, v,
                     "vertex " + std::to_string(v) + " has a coordinate that float32 cannot hold"};
      }
      if (value < low[axis]) low[axis] = value;
      if (value > high[axis]) high[axis] = value;
    }
  }
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lattice.min[axis] = low[axis];
    const double size = high[axis] - low[axis];
    if (size > extent) extent = size;
  }
  lattice.step = extent / lattice.max_index();
  // The extent of a mesh of denormal size can vanish in the division.
  if (extent > 0 && lattice.step == 0) lattice.step = std::numeric_limits<double>::denorm_min();
  return lattice;
}

std::optional<Lattice> Lattice::of_multiples(const TriangleMesh& mesh, const Unit& unit) {
  std::array<std::int64_t, 3> low{kMaxWhole, kMaxWhole, kMaxWhole};
  std::array<std::int64_t, 3> high{-kMaxWhole, -kMaxWhole, -kMaxWhole};
  for (const Position& p : mesh.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t k = nearest_whole(unit, p[axis]);
      if (k < low[axis]) low[axis] = k;
      if (k > high[axis]) high[axis] = k;
    }
  }
  Lattice lattice;
  lattice.scalar = mesh.scalar;
  lattice.bits = kMinLatticeBits;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (low[axis] <= -kMaxWhole || high[axis] >= kMaxWhole) return std::nullopt;
    while (high[axis] - low[axis] > lattice.max_index()) {
      if (++lattice.bits > kMaxLatticeBits) return std::nullopt;
    }
  }
  lattice.set_unit(unit, low);
  if (!lattice.valid()) return std::nullopt;
  return lattice;
}

void Lattice::set_unit(const Unit& multiples_of, const std::array<std::int64_t, 3>& from) {
  unit = multiples_of;
  origin = from;
  step = multiple_of(multiples_of, 1);
  for (std::size_t axis = 0; axis < 3; ++axis) min[axis] = multiple_of(multiples_of, from[axis]);
}

bool Lattice::valid() const {
  if (bits < kMinLatticeBits || bits > kMaxLatticeBits) return false;
  if (unit ? !codec::valid(*unit) : exact) return false;
  for (std::int64_t k : origin) {
    if (k < -kMaxWhole || k > kMaxWhole - (std::int64_t{1} << kMaxLatticeBits)) return false;
  }
  if (!std::isfinite(step) || step < 0) return false;
  for (double value : min) {
    if (!std::isfinite(value) || std::abs(value) > kLargestCoordinate) return false;
    const double far = value + step * max_index();
    if (!std::isfinite(round_to(scalar, value)) || !std::isfinite(round_to(scalar, far))) return false;
  }
  return true;
}

std::int32_t Lattice::snap(double coordinate, int axis) const {
  if (unit) {
    const std::int64_t offset = nearest_whole(*unit, coordinate) - origin[static_cast<std::size_t>(axis)];
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(offset, 0, max_index()));
  }
  if (step == 0) return 0;
  const double index = (coordinate - min[static_cast<std::size_t>(axis)]) / step + 0.5;
  if (!(index > 0)) return 0;
  if (index >= max_index()) return max_index();
  return static_cast<std::int32_t>(index);
}

LatticePoint Lattice::snap(const Position& p) const {
  return {snap(p[0], 0), snap(p[1], 1), snap(p[2], 2)};
}

Position Lattice::position(const LatticePoint& p) const {
  Position result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = unit ? multiple_of(*unit, origin[axis] + p[axis]) : min[axis] + p[axis] * step;
    result[axis] = round_to(scalar, value);
  }
  return result;
}

Position Lattice::position_of_middle(const LatticePoint& middle) const {
  Position result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double value = 0;
    if (unit) {
      const std::int64_t k = origin[axis] + (middle[axis] >> 1);
      value = multiple_of(*unit, k);
      if ((middle[axis] & 1) != 0) value = value * 0.5 + multiple_of(*unit, k + 1) * 0.5;
    } else {
      value = min[axis] + (middle[axis] * 0.5) * step;
    }
    result[axis] = round_to(scalar, value);
  }
  return result;
}

}  // namespace pmcd::codec
