// SPDX-License-Identifier: MIT
// What a lossless mesh's coordinates are made of: finds the lattice and the form of the exactness section that cost
// least. It estimates on a sample what the shared code (codec/exactness.h) would spend; it codes nothing.
#pragma once

#include <span>

#include "codec/lattice/exactness_form.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

/// The lattice under a lossless mesh: that of the multiples of a unit, if all coordinates, or enough of them, are some;
/// else `plain`. REQUIRES: plain is Lattice::over the mesh. [linear in the vertices, for those units that pass a
/// sample]
Lattice choose_lattice(const TriangleMesh& mesh, const Lattice& plain);

/// The form of the exactness section over a lattice. `points`: lattice.snap of each position. [linear]
ExactnessForm choose_form(const TriangleMesh& mesh, const Lattice& lattice, std::span<const LatticePoint> points);

}  // namespace pmcd::codec
