// SPDX-License-Identifier: MIT
// What the geometry that is known says of what lies beyond a half-edge of the growing base mesh: where a new vertex
// would stand and how surely, and how likely it is that the face closes the gap to the left or to the right, or runs
// into another part of the border. It codes nothing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "codec/base/front.h"
#include "codec/geometry/vec.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

/// The gap between two neighbouring half-edges of the border, seen from the gate as one to be closed by a single face.
struct Side {
  std::uint32_t vertex = kNone;  ///< the far end of the neighbour; kNone: there is nothing to close with
  std::uint32_t entry = kNone;   ///< of Front::attach
  double gap = 0;                ///< angle, radians
  double closing = 0;            ///< log odds that the face closes it
};

struct Outlook {
  Side left;   ///< at the gate's origin
  Side right;  ///< at its target
  // What follows expects a new vertex.
  Vec position;           ///< unbounded
  Vec normal;             ///< of the gate's face; unit length, or zero when the face has no area
  double length = 1;      ///< typical edge length here
  double tangential = 1;  ///< expected mean distance per axis, within the surface
  double across = 1;      ///< the same along the normal
  // Cells where machine parts put their vertices: the parallelograms' corners, then the neighbours' own coordinates.
  static constexpr std::size_t kExact = 8;
  std::array<std::array<double, 3>, kExact> exact{};
  std::array<bool, kExact> exact_known{};
  // What learn() needs again.
  static constexpr std::size_t kFeatures = 4;
  Vec middle;  ///< of the gate
  std::array<Vec, kFeatures> feature{};
};

class Vicinity {
 public:
  /// REQUIRES: points holds every vertex of the front.
  Outlook look(const Front& front, const std::vector<LatticePoint>& points, std::uint32_t gate) const;

  /// How urgent a gate is: the smallest gap first, so that what is closed soon is closed for sure.
  [[nodiscard]] double urgency(const Front& front, const std::vector<LatticePoint>& points, std::uint32_t gate) const;

  /// A face was added: its angles count at its corners. REQUIRES: as look().
  void add_face(const Face& face, const std::vector<LatticePoint>& points);
  /// The position of a new vertex that was expected with `outlook`.
  void learn(const Outlook& outlook, const LatticePoint& actual);

 private:
  static constexpr std::size_t kFeatures = Outlook::kFeatures;
  // At the origin of `leaving`, between the half-edge before it and itself.
  [[nodiscard]] double gap(const Front& front, const std::vector<LatticePoint>& points, std::uint32_t leaving) const;

  std::vector<double> angles_;  // by vertex: sum over its faces
  std::array<std::array<double, kFeatures>, kFeatures> matrix_{};
  std::array<double, kFeatures> right_{};
  std::array<double, kFeatures> change_{};  // of the weights against the usual ones
  double tangential_ = 2.75;                // sums of residuals relative to the edge length, decaying
  double across_ = 2.75;
  double seen_ = 5;
  unsigned until_solved_ = 0;
};

}  // namespace pmcd::codec
