// SPDX-License-Identifier: MIT
// How far a vertex will lie from where it is expected, along the surface and across it: a regression of the logarithm
// of what was seen on logarithms of what the ring shows (size, unevenness, how its own vertices came out), and a
// calibration for what is left. After part 2 of the project's codec notes.
#pragma once

#include <array>
#include <cstddef>

#include "codec/geometry/least_squares.h"

namespace pmcd::codec {

/// Two lengths: within the surface (a mean over its two directions) and along its normal.
struct Spread {
  float tangential = 0;
  float across = 0;
};

class SpreadModel {
 public:
  static constexpr std::size_t kSigns = 8;
  static constexpr std::size_t kGroups = 9;  ///< of rings that are calibrated apart
  /// Lengths that the ring shows, in any one unit.
  struct Signs {
    float radius = 0;      ///< mean distance of the ring from the first guess
    Spread neighbours;     ///< mean spread of the ring's vertices
    float unevenness = 0;  ///< of the ring, across its mean plane
    float parallelogram_across = 0;
    float parallelogram_tangential = 0;
    float crowding = 0;  ///< how far the ring is from evenly spaced
    float bend = 0;      ///< bilaplacian, across
  };

 private:
  using Fit = LeastSquares<kSigns + 1, 2>;

 public:
  using Terms = Fit::Equation;  ///< a one, the logarithms of the signs in cells, room for those of what was seen

  SpreadModel();

  static Terms terms(const Signs& signs, float inverse_cell);
  /// In cells.
  [[nodiscard]] Spread expect(const Terms& terms, std::size_t group) const;
  /// `seen` in cells.
  void learn(const Terms& terms, std::size_t group, const Spread& expected, const Spread& seen);

 private:
  struct Calibration {
    float actual = 1;
    float expected = 1;
  };

  Fit fit_;
  std::array<std::array<Calibration, 2>, kGroups> calibration_;
};

}  // namespace pmcd::codec
