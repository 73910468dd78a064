// SPDX-License-Identifier: MIT
// Meshes without faces, and their lattices: for tests of coordinates alone.
#pragma once

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec::testing {

inline TriangleMesh cloud(std::vector<Position> positions, Scalar scalar = Scalar::float32) {
  return {scalar, std::move(positions), {}};
}

inline Lattice over(const TriangleMesh& mesh, unsigned bits) {
  const Result<Lattice> lattice = Lattice::over(mesh, bits);
  EXPECT_TRUE(lattice.ok());
  return lattice ? *lattice : Lattice();
}

}  // namespace pmcd::codec::testing
