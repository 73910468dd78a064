// SPDX-License-Identifier: MIT
// Where a vertex probably lies. Features of its one-ring and of what lies around that (means, bilaplacian, normals,
// parallelograms) are weighed by online least squares, apart for each kind of ring and for how much of it is known. It
// codes nothing, and how sure the answer is says spread.h.
#pragma once

#include <array>
#include <cstdint>

#include "codec/geometry/least_squares.h"
#include "codec/geometry/ring.h"
#include "codec/geometry/spread.h"
#include "codec/geometry/surface.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// What is coded about a vertex: its position at all, in one of the passes of a packet (the last is 0: of those before
/// it the ring is known less), or further digits of a position that is known coarsely.
inline constexpr std::size_t kEarliestPass = 3;
inline constexpr std::size_t kFurtherDigits = kEarliestPass + 1;
inline constexpr std::size_t kStages = kFurtherDigits + 1;

/// What is seen of a vertex before its position is known. Vectors are relative to where it stands provisionally.
struct Expectation {
  static constexpr std::size_t kFeatures = 5;
  using Fit = LeastSquares<kFeatures, 1>;

  LatticePoint origin{};  ///< half lattice steps, as all that follows
  Four position{};        ///< the prediction, unbounded
  Four normal{};          ///< unit length, or zero when the ring has no area
  Spread spread;          ///< in cells
  float cell = 2;
  // What learn() needs again.
  Four mean{};                              ///< the first guess, to which the features are offsets
  std::array<Fit::Equation, 3> equation{};  ///< by axis; the target is open
  SpreadModel::Terms spread_terms{};
  float radius = 0;
  std::size_t stage = 0;
  std::size_t group = 0;
};

class Predictor {
 public:
  Predictor();

  /// Expects the position of `centre` from its one-ring `ring` and what lies around that; vertices that are not decoded
  /// yet stand at provisional positions, the centre too. `shift`: binary digits that the answer will not have. [valence
  /// of the centre, at most Ring::kMost]
  [[nodiscard]] Expectation expect(const Ring& ring, const Surface& surface, std::uint32_t centre, unsigned shift,
                                   std::size_t stage) const;

  /// Learns from the decoded position (half lattice steps). Answers how far it lay off, for the neighbours to come.
  RelativeSpread learn(const Expectation& expected, const LatticePoint& actual);

 private:
  static constexpr std::size_t kGroups = SpreadModel::kGroups;  // ring of 3 to 7, 8 or more; border of 2, 3, 4 or more

  std::array<std::array<Expectation::Fit, kGroups>, kStages> position_;
  std::array<SpreadModel, kStages> spread_;
};

}  // namespace pmcd::codec
