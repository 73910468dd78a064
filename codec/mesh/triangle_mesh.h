// SPDX-License-Identifier: MIT
// An indexed triangle mesh as files hold it and as the decoder gives it out. Plain data: no adjacency, no promise
// that it is manifold (halfedge_mesh.h checks that).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pmcd::codec {

using Position = std::array<double, 3>;
using Face = std::array<std::uint32_t, 3>;  ///< vertex indices, counter-clockwise seen from outside

/// How coordinates are stored in files. The codec computes in double either way; a float32 mesh holds only values that
/// are exactly float32, and its bits (including -0.0) come back.
enum class Scalar : std::uint8_t { float32 = 0, float64 = 1 };

struct TriangleMesh {
  Scalar scalar = Scalar::float32;
  std::vector<Position> positions;
  std::vector<Face> faces;
};

}  // namespace pmcd::codec
