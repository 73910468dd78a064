// SPDX-License-Identifier: MIT
#include "tests/codec/golden.h"

#include <bit>
#include <cmath>
#include <cstdio>
#include <utility>

#include "codec/decoder.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {

namespace {

// A plate whose columns stand in one of three heights.
TriangleMesh terraces() {
  Random random(3);
  TriangleMesh mesh = grid(18, 15, 3);
  std::vector<double> height(32);
  for (double& h : height) h = static_cast<double>(random.below(3)) * 0.37;
  for (Position& p : mesh.positions) {
    p[2] = height[static_cast<std::size_t>(p[0] * 18 + 0.5)];
    for (double& x : p) x = round_to(Scalar::float32, x);
  }
  return mesh;
}

// The same with columns and rows that widen, so that it is no mirror image of itself.
TriangleMesh lopsided_terraces() {
  TriangleMesh mesh = terraces();
  for (Position& p : mesh.positions) {
    for (std::size_t axis = 0; axis < 2; ++axis) p[axis] = round_to(Scalar::float32, p[axis] * (1 + p[axis]));
  }
  return mesh;
}

// A sphere with bumps that are the same on both sides of x = 0, in decimals of four digits.
TriangleMesh mirrored() {
  TriangleMesh mesh = sphere(3);
  for (Position& p : mesh.positions) {
    const double bump = 1 + 0.13 * p[1] * p[2] + 0.2 * p[0] * p[0] * p[2];
    for (double& x : p) x = round_to(Scalar::float32, std::round(x * bump * 10000) / 10000);
  }
  return mesh;
}

}  // namespace

std::vector<GoldenMesh> golden_meshes() {
  std::vector<GoldenMesh> all;
  auto add = [&](const char* name, TriangleMesh mesh, std::optional<unsigned> bits, bool cleaning = false,
                 std::optional<unsigned> levels = std::nullopt, Effort effort = Effort::standard) {
    EncodeOptions options;
    options.bits = bits;
    options.cleaning = cleaning;
    options.max_packets_after_base = levels;
    options.effort = effort;
    all.push_back({name, std::move(mesh), options});
  };
  Random random(1906);
  auto noisy = [&](TriangleMesh mesh, double amplitude) {
    jitter(mesh, amplitude, random);
    return mesh;
  };
  add("empty", {}, std::nullopt);
  add("tetrahedron-8", tetrahedron(), 8);
  add("sphere-12", noisy(sphere(3), 0.02), 12);
  add("sphere-12-cleaning", noisy(sphere(3), 0.02), 12, true);
  add("torus-lossless", noisy(torus(10, 8), 0.01), std::nullopt);
  add("torus-double", as_float64(torus(6, 6), random), std::nullopt);
  add("plate-16", noisy(holed_plate(2, 2), 0.05), 16);
  add("grid-10", noisy(grid(14, 11, 6), 0.01), 10);
  add(
      "ragged-grid-10-two-levels",
      [&] {
        TriangleMesh mesh = grid(10, 10, 2);
        flip_edges(mesh, 300, random);
        return mesh;
      }(),
      10, false, 2);
  add(
      "components-isolated-lossless",
      [&] {
        TriangleMesh mesh = joined(joined(noisy(sphere(2), 0.03), scaled(torus(4, 5), 0.125)), single_triangle());
        add_isolated(mesh, 9, random);
        sprinkle_zeros(mesh, random);
        return mesh;
      }(),
      std::nullopt);
  // Steps of a whole lattice step, the same on either side: coordinates repeat, and the mesh is its own mirror image.
  add("terraces-12", terraces(), 12);
  add("mirrored-lossless", mirrored(), std::nullopt);
  add(
      "one-point-24",
      [] {
        TriangleMesh mesh = sphere(1);
        mesh.positions.assign(mesh.positions.size(), {-1, 0.5, 4});
        return mesh;
      }(),
      24);
  auto add_best = [&](const char* name, TriangleMesh mesh, unsigned bits, bool cleaning = false) {
    add(name, std::move(mesh), bits, cleaning, std::nullopt, Effort::best);
  };
  add_best("sphere-12-best", noisy(sphere(3), 0.02), 12);
  add_best("sphere-12-cleaning-best", noisy(sphere(3), 0.02), 12, true);
  add_best("ragged-grid-10-best", noisy(grid(14, 11, 6), 0.01), 10);
  add_best("terraces-12-best", terraces(), 12);
  add_best("lopsided-terraces-12-best", lopsided_terraces(), 12);
  return all;
}

std::uint64_t mesh_digest(const TriangleMesh& mesh) {
  std::uint64_t digest = 0xCBF29CE484222325u;
  auto add = [&](std::uint64_t word) {
    for (unsigned i = 0; i < 8; ++i) digest = (digest ^ ((word >> (8 * i)) & 0xFF)) * 0x100000001B3u;
  };
  add(mesh.positions.size());
  add(mesh.faces.size());
  for (const Position& p : mesh.positions) {
    for (double x : p) add(std::bit_cast<std::uint64_t>(x));
  }
  for (const Face& f : mesh.faces) {
    for (std::uint32_t v : f) add(v);
  }
  return digest;
}

std::vector<std::string> level_lines(const std::string& name, const std::vector<std::vector<std::byte>>& packets) {
  std::vector<std::string> lines;
  Decoder decoder;
  for (const std::vector<std::byte>& packet : packets) {
    const Result<Level> level = decoder.apply(packet);
    if (!level) return {};
    std::array<char, 17> digest{};
    std::snprintf(digest.data(), digest.size(), "%016llx",
                  static_cast<unsigned long long>(mesh_digest(decoder.mesh())));
    lines.push_back(name + " " + std::to_string(level->level) + " " + std::to_string(level->vertices) + " " +
                    std::to_string(level->faces) + " " + digest.data());
  }
  return lines;
}

}  // namespace pmcd::codec::testing
