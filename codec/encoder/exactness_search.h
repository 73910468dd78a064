// SPDX-License-Identifier: MIT
// What a lossless mesh's coordinates are made of: finds the lattice and the form of the exactness section that cost
// least. It estimates on a sample what the shared code (codec/exactness.h) would spend; it codes nothing.
#pragma once

#include "codec/lattice/exactness_form.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

struct LosslessPlan {
  Lattice lattice;
  ExactnessForm form;  ///< means nothing if the lattice is exact
};

/// The lattice under a lossless mesh and the form of its exactness section. The lattice is `plain`, or the multiples of
/// a unit, if all coordinates or enough of them are some, or a grid of another step, if enough lie on one. REQUIRES:
/// plain is Lattice::over the mesh. [some 20 ms, then n log n]
LosslessPlan plan_lossless(const TriangleMesh& mesh, const Lattice& plain);

}  // namespace pmcd::codec
