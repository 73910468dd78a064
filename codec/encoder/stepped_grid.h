// SPDX-License-Identifier: MIT
// Finds the grid of a mesh whose few different coordinates were scaled and then rounded, to decimals or floats: gaps
// between them are multiples of one step, up to that rounding. It proves nothing: whoever uses the grid tests it.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "codec/lattice/exactness_form.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

struct RoundedValue {
  double value = 0;
  double blur = 0;  ///< half a rounding
};

class SteppedGridSearch {
 public:
  /// `fine`: what the coordinates were rounded to (null: floats). [n log n]
  SteppedGridSearch(const TriangleMesh& mesh, const Decimals* fine);

  /// The grid that fits best, with some coordinate near its origin, or nothing. `blur`: coordinates may have been moved
  /// by as much before they were rounded. [a few milliseconds at most]
  [[nodiscard]] std::optional<SteppedGrid> find(double blur = 0) const;

 private:
  std::array<std::vector<RoundedValue>, 3> sharp_;  // by axis: the different values that are looked at, ascending
};

}  // namespace pmcd::codec
