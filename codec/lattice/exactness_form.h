// SPDX-License-Identifier: MIT
// What a mesh's coordinates look like below the lattice: what the exactness section (codec/exactness.h) says once,
// before it lifts vertex by vertex. Found by the encoder (encoder/exactness_search.h).
#pragma once

#include <array>
#include <optional>

#include "codec/lattice/decimals.h"

namespace pmcd::codec {

/// A grid of any step, whose points were rounded to decimals or floats: what scaling a mesh of few different
/// coordinates leaves.
struct SteppedGrid {
  double step = 0;
  std::array<double, 3> origin{};
};

/// Whether a stream may claim it: all finite, the step above 0.
bool valid(const SteppedGrid& grid);

struct ExactnessForm {
  std::optional<Decimals> fine;     ///< what the coordinates are, or lie next to; none: any float
  std::optional<Decimals> coarse;   ///< what many of them are
  std::optional<SteppedGrid> grid;  ///< instead of coarse: many are the fine ones nearest to its points
  struct Axis {
    bool repeats = false;  ///< values come again: the last ones of each cell are remembered
    bool negated = false;  ///< ... and so do their negatives: the mesh is its own mirror image
    bool coarse = false;   ///< a bit tells whether a coordinate is one of `coarse`, or of `grid`
    bool strays = false;   ///< coordinates may lie some floats off
  };
  std::array<Axis, 3> axes{};
};

}  // namespace pmcd::codec
