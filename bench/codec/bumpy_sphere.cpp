// SPDX-License-Identifier: GPL-3.0-or-later
// One shape at any number of vertices, for bench/codec/growth: a sphere with bumps of all sizes down to the edges of
// the mesh, as rough at each scale as at the others, and irregularly triangulated. A bigger mesh is the same shape seen
// finer. Deterministic; writes a binary PLY file and prints a few facts as JSON.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/codec/sphere_mesh.h"
#include "codec/import/error.h"
#include "codec/import/write_mesh.h"

namespace pmcd::bench {
namespace {

using codec::Vec;

/// Smooth noise with one random value a cell, from -1 to 1.
double noise(const Vec& p, std::uint64_t seed) {
  std::array<std::int64_t, 3> cell{};
  Vec weight;
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = std::floor(p[k]);
    cell[k] = static_cast<std::int64_t>(low);
    const double t = p[k] - low;
    weight[k] = t * t * t * (t * (6 * t - 15) + 10);
  }
  double sum = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    double share = 1;
    std::uint64_t key = seed;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t up = corner >> k & 1;
      share *= up ? weight[k] : 1 - weight[k];
      key = key * 0x100000001b3u + static_cast<std::uint64_t>(cell[k] + static_cast<std::int64_t>(up));
    }
    sum += share * hashed(key);
  }
  return sum;
}

double mean_edge(const SphereMesh& mesh) {
  double sum = 0;
  for (const codec::Face& f : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      sum += length(mesh.points[f[k]] - mesh.points[f[(k + 1) % 3]]);
    }
  }
  return sum / static_cast<double>(3 * mesh.faces.size());
}

/// Octaves of noise whose height falls as their wavelength, fading out between four edges and two; then a little of
/// its own for each vertex.
void displace(SphereMesh& mesh) {
  const double edge = mean_edge(mesh);
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    Vec& p = mesh.points[v];
    double radius = 1 + 0.03 * edge * hashed(0x1000000000000u + v);
    std::uint64_t octave = 1;
    for (double frequency = 2; frequency * edge < 0.5; frequency *= 2, ++octave) {
      const double fade = std::min(1.0, 0.5 / (frequency * edge) - 1);
      radius += 0.25 / frequency * fade * noise(p * frequency, octave << 56);
    }
    p = p * radius;
  }
}

double extent(const SphereMesh& mesh) {
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(mesh.points.begin(), mesh.points.end(),
                                                 [k](const Vec& a, const Vec& b) { return a[k] < b[k]; });
    most = std::max(most, (*high)[k] - (*low)[k]);
  }
  return most;
}

/// Of vertices that have not six neighbours.
double irregular_share(const SphereMesh& mesh) {
  std::vector<std::uint32_t> valence(mesh.points.size());
  for (const codec::Face& f : mesh.faces) {
    for (const std::uint32_t v : f) ++valence[v];
  }
  const auto regular = std::count(valence.begin(), valence.end(), 6u);
  return 1 - static_cast<double>(regular) / static_cast<double>(valence.size());
}

int run(double vertices, const std::string& path) {
  const auto n = static_cast<std::uint32_t>(std::lround(std::sqrt((vertices - 2) / 10)));
  SphereMesh mesh = irregular_sphere(n);
  displace(mesh);
  codec::TriangleMesh out;
  out.faces = mesh.faces;
  out.positions.reserve(mesh.points.size());
  for (Vec& p : mesh.points) {
    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>(p[k]);
    out.positions.push_back({p.x, p.y, p.z});
  }
  const auto written = import::write_mesh(path, out);
  if (!written) {
    std::cerr << "bumpy_sphere: " << import::to_line(written.error()) << '\n';
    return 1;
  }
  std::cout << nlohmann::json{{"vertices", mesh.points.size()},
                              {"mean_edge", mean_edge(mesh)},
                              {"extent", extent(mesh)},
                              {"irregular_share", irregular_share(mesh)}}
            << '\n';
  return 0;
}

}  // namespace
}  // namespace pmcd::bench

int main(int argc, char** argv) try {
  double vertices = 0;
  if (argc == 3) std::from_chars(argv[1], argv[1] + std::strlen(argv[1]), vertices);
  if (!(vertices >= 100 && vertices <= 1e8)) {
    std::cerr << "usage: bumpy_sphere VERTICES OUT.ply (100 to 1e8 vertices; the nearest 10 n^2 + 2 are made)\n";
    return 2;
  }
  return pmcd::bench::run(vertices, argv[2]);
} catch (const std::exception& error) {
  std::cerr << "bumpy_sphere: " << error.what() << '\n';
  return 1;
}
