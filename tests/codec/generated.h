// SPDX-License-Identifier: MIT
// Meshes made by formula and by seed: the shapes, the awkward connectivity and the awkward coordinates that tests feed
// to the codec. The same seed gives the same bits on every machine: no libm function but sqrt, no library distribution.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec::testing {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t bits() { return engine_(); }
  /// 0 .. count - 1. REQUIRES: count > 0.
  std::uint32_t below(std::uint64_t count) { return static_cast<std::uint32_t>(engine_() % count); }
  /// 0 <= x < 1.
  double unit() { return static_cast<double>(engine_() >> 11) / 9007199254740992.0; }
  bool one_in(std::uint64_t count) { return engine_() % count == 0; }

 private:
  std::mt19937_64 engine_;
};

// Shapes. Positions are float32 values.

TriangleMesh single_triangle();
TriangleMesh tetrahedron();
TriangleMesh octahedron();
/// An octahedron whose faces were split in four `levels` times, blown up to a sphere: 4^(levels + 1) + 2 vertices.
TriangleMesh sphere(unsigned levels);
TriangleMesh uv_sphere(std::uint32_t rings, std::uint32_t sides);
/// Genus 1, rings * sides vertices. REQUIRES: both >= 3.
TriangleMesh torus(std::uint32_t rings, std::uint32_t sides);
/// A thick plate with `holes` square holes through it: closed, of genus `holes`; cells of a hole: `cells` a side.
TriangleMesh holed_plate(std::uint32_t holes, std::uint32_t cells);
/// An open, wavy height field; `holes` square holes of one cell are spread over it.
TriangleMesh grid(std::uint32_t columns, std::uint32_t rows, std::uint32_t holes);
/// A hub with `sides` faces around it; closed by a second hub, or an open fan around the hub.
TriangleMesh bipyramid(std::uint32_t sides);
TriangleMesh cone(std::uint32_t sides);
/// An octahedron with a vertex of valence 3 in each of two neighbouring faces.
TriangleMesh facing_threes();

// Changes. Connectivity stays manifold and oriented.

TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b);
/// Splits `count` random faces in three, each at its centre.
void split_faces(TriangleMesh& mesh, std::uint32_t count, Random& random);
/// Tries to flip `count` random edges; those that would double an edge stay.
void flip_edges(TriangleMesh& mesh, std::uint32_t count, Random& random);
/// Vertices in no face; every third lies where the one before lies.
void add_isolated(TriangleMesh& mesh, std::uint32_t count, Random& random);
/// The same mesh in other numbers, faces turned.
TriangleMesh renumbered(const TriangleMesh& mesh, Random& random);
/// Moves every coordinate by up to `amplitude`, as a float32 mesh or a double mesh with full mantissas.
void jitter(TriangleMesh& mesh, double amplitude, Random& random);
TriangleMesh as_float64(TriangleMesh mesh, Random& random);
TriangleMesh scaled(TriangleMesh mesh, double factor);
/// Some vertices jump onto the first corner of one of their faces: faces of zero area.
void squash(TriangleMesh& mesh, std::uint32_t count, Random& random);
/// Some coordinates become -0.0, 0.0 or a denormal number.
void sprinkle_zeros(TriangleMesh& mesh, Random& random);

/// A random mesh of the whole family above, of up to about 700 vertices: everything is drawn from the seed.
TriangleMesh any_mesh(std::uint64_t seed);

/// Named meshes that between them show every awkward property; for tests that go through all of them.
std::vector<std::pair<std::string, TriangleMesh>> zoo();

}  // namespace pmcd::codec::testing
