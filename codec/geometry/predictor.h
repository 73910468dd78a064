// SPDX-License-Identifier: MIT
// Where a removed vertex probably was, and how sure that is. Features of the refined connectivity around it (ring mean,
// bilaplacian, vertex normals, parallelograms) are weighed by a small online least-squares fit; the spread along and
// across the surface is learnt from the residuals of the neighbours. It codes nothing.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/conquest/patch.h"
#include "codec/geometry/vec.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

inline constexpr std::size_t kFeatures = 3;

/// What is seen of a vertex before its position is known.
struct Expectation {
  Vec position;           ///< the prediction, unbounded
  Vec normal;             ///< unit length, or zero when the ring has no area
  double tangential = 1;  ///< expected spread within the surface, lattice units
  double across = 1;      ///< expected spread along the normal
  // What learn() needs again.
  Vec mean;  ///< the first guess, to which the features are offsets
  std::array<Vec, kFeatures> feature{};
  double radius = 0;  ///< mean distance of the ring from the first guess
  double neighbour_tangential = 0;
  double neighbour_across = 0;
  std::size_t group = 0;  ///< of patches that share their weights
};

class Predictor {
 public:
  /// Expects the position of `centre`, inserted but not decoded, from its one-ring and what lies around that.
  /// `points` holds provisional positions for vertices of the same pass that are not decoded yet.
  /// [the valences around; ring vertices of valence above 24 are left out of the features]
  Expectation expect(const HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::uint32_t centre) const;

  /// Learns from the decoded position and remembers the residual for the neighbours to come.
  void learn(const Expectation& expected, std::uint32_t centre, const LatticePoint& actual);

  /// Room for vertices up to `count`; new ones start with the spread of a stranger.
  void resize(std::size_t count);

 private:
  // Normal equations of one group's fit, decaying; solved now and then.
  struct Fit {
    std::array<std::array<double, kFeatures>, kFeatures> matrix{};
    std::array<double, kFeatures> right{};
    std::array<double, kFeatures> weight{};
    unsigned until_solved = 0;

    void add(const std::array<Vec, kFeatures>& feature, const Vec& target, double importance);
    void solve();
  };
  // How large residuals came out against what was expected, decaying.
  struct Calibration {
    double actual = 1;
    double expected = 1;
  };
  struct Spread {
    float tangential = 0.2f;
    float across = 0.2f;
  };

  static constexpr std::size_t kGroups = 7;  // ring of 3, 4, 5, 6; border of 2 (ears), 3, 4

  std::array<Fit, kGroups> fit_;
  std::array<Calibration, kGroups> tangential_;
  std::array<Calibration, kGroups> across_;
  std::vector<Spread> spread_;  // by vertex, relative to the ring radius
};

}  // namespace pmcd::codec
