// SPDX-License-Identifier: MIT
// Where a vertex probably lies. Features of its one-ring and of what lies around that (means, bilaplacian, normals,
// parallelograms) are weighed by online least squares, apart for each kind of ring and for how much of it is known. It
// codes nothing, and how sure the answer is says spread.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "codec/geometry/least_squares.h"
#include "codec/geometry/ring.h"
#include "codec/geometry/spread.h"
#include "codec/geometry/surface.h"
#include "codec/geometry/vec.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// What is coded about a vertex: its position at all, in one of the passes of a packet (the last is 0: of those before
/// it the ring is known less), or further digits of a position that is known coarsely.
inline constexpr std::size_t kEarliestPass = 3;
inline constexpr std::size_t kFurtherDigits = kEarliestPass + 1;
inline constexpr std::size_t kStages = kFurtherDigits + 1;

/// What is seen of a vertex before its position is known.
struct Expectation {
  static constexpr std::size_t kFeatures = 7;

  Ring ring;
  Vec position{};  ///< the prediction, half lattice steps, unbounded
  Vec normal{};    ///< unit length, or zero when the ring has no area
  Spread spread;   ///< in cells
  // What learn() needs again.
  double cell = 2;  ///< half lattice steps
  Vec mean{};       ///< the first guess, to which the features are offsets
  std::array<Vec, kFeatures> feature{};
  SpreadModel::Terms spread_terms{};
  double radius = 0;
  std::size_t stage = 0;
  std::size_t group = 0;
};

class Predictor {
 public:
  Predictor();

  /// Expects the position of `centre` from its one-ring and what lies around that. `points` holds provisional positions
  /// for vertices that are not decoded yet. `shift`: binary digits that the answer will not have.
  /// [valence of the centre, at most Ring::kMost]
  [[nodiscard]] Expectation expect(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points,
                                   const Surface& surface, std::uint32_t centre, unsigned shift,
                                   std::size_t stage) const;

  /// Learns from the decoded position (half lattice steps) and notes the residual for the neighbours to come.
  void learn(const Expectation& expected, std::uint32_t centre, const LatticePoint& actual, Surface& surface);

 private:
  using PositionFit = LeastSquares<Expectation::kFeatures, 1>;
  static constexpr std::size_t kGroups = SpreadModel::kGroups;  // ring of 3 to 7, 8 or more; border of 2, 3, 4 or more

  std::array<std::array<PositionFit, kGroups>, kStages> position_;
  std::array<SpreadModel, kStages> spread_;
};

}  // namespace pmcd::codec
