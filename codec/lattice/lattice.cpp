// SPDX-License-Identifier: MIT
#include "codec/lattice/lattice.h"

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

}  // namespace

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

bool Lattice::valid() const {
  if (bits < kMinLatticeBits || bits > kMaxLatticeBits) return false;
  if (!std::isfinite(step) || step < 0) return false;
  for (double value : min) {
    if (!std::isfinite(value) || std::abs(value) > kLargestCoordinate) return false;
    const double far = value + step * max_index();
    if (scalar == Scalar::float32 ? !std::isfinite(static_cast<float>(far)) : !std::isfinite(far)) return false;
  }
  return true;
}

std::int32_t Lattice::snap(double coordinate, int axis) const {
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
    const double value = min[axis] + p[axis] * step;
    result[axis] = scalar == Scalar::float32 ? to_float32(value) : value;
  }
  return result;
}

Position Lattice::position_of_middle(const LatticePoint& middle) const {
  Position result{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double value = min[axis] + (middle[axis] * 0.5) * step;
    result[axis] = scalar == Scalar::float32 ? to_float32(value) : value;
  }
  return result;
}

}  // namespace pmcd::codec
