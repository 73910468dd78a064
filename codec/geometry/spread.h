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
  double tangential = 0;
  double across = 0;
};

class SpreadModel {
 public:
  static constexpr std::size_t kTerms = 9;
  static constexpr std::size_t kGroups = 9;  ///< of rings that are calibrated apart
  using Terms = std::array<double, kTerms>;

  /// What the ring shows, in any one unit: see terms().
  struct Signs {
    double radius = 0;      ///< mean distance of the ring from the first guess
    Spread neighbours;      ///< mean spread of the ring's vertices
    double unevenness = 0;  ///< of the ring, across its mean plane
    double parallelogram_across = 0;
    double parallelogram_tangential = 0;
    double crowding = 0;  ///< how far the ring is from evenly spaced
    double bend = 0;      ///< bilaplacian, across
  };

  SpreadModel();

  /// Logarithms of the signs in cells, with a one in front.
  static Terms terms(const Signs& signs, double inverse_cell);
  /// In cells.
  [[nodiscard]] Spread expect(const Terms& terms, std::size_t group) const;
  /// `seen` in cells.
  void learn(const Terms& terms, std::size_t group, const Spread& expected, const Spread& seen);

 private:
  struct Calibration {
    double actual = 1;
    double expected = 1;
  };

  LeastSquares<kTerms, 2> fit_;
  std::array<std::array<Calibration, 2>, kGroups> calibration_;
};

}  // namespace pmcd::codec
