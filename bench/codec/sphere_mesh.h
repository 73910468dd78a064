// SPDX-License-Identifier: GPL-3.0-or-later
// An irregular triangulation of the unit sphere with as many vertices as one likes: a divided icosahedron whose
// vertices were moved at random and whose edges were flipped to suit. Deterministic: IEEE doubles, + - * / and sqrt.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/geometry/vec.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::bench {

struct SphereMesh {
  std::vector<codec::Vec> points;
  std::vector<codec::Face> faces;
};

/// 10 n^2 + 2 vertices; about half of them have not six neighbours. REQUIRES: n >= 2. [linear, about 100 bytes a
/// vertex]
SphereMesh irregular_sphere(std::uint32_t n);

/// A well-mixed function of its argument (the finalizer of splitmix64), as a number from -1 to 1.
inline double hashed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  x ^= x >> 31;
  return static_cast<double>(x >> 11) * 0x1p-52 - 1;
}

}  // namespace pmcd::bench
