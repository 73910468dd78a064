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
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "codec/import/write_mesh.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::bench {
namespace {

using Vec = codec::Position;

Vec operator+(const Vec& a, const Vec& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vec operator-(const Vec& a, const Vec& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vec operator*(double s, const Vec& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
double dot(const Vec& a, const Vec& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vec normalised(const Vec& a) {
  return 1 / std::sqrt(dot(a, a)) * a;
}

/// A well-mixed function of its argument (the finalizer of splitmix64), as a number from -1 to 1.
double hashed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  x ^= x >> 31;
  return static_cast<double>(x >> 11) * 0x1p-52 - 1;
}

/// Of moving and flipping; each makes the mesh more irregular.
constexpr std::uint64_t kRounds = 3;

/// The icosahedron with each edge in `n` parts and each face in n^2, on the unit sphere: 10 n^2 + 2 vertices.
class Icosphere {
 public:
  explicit Icosphere(std::uint32_t n) : n_(n) {
    const double phi = (1 + std::sqrt(5.0)) / 2;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double one : {-1.0, 1.0}) {
        for (const double long_side : {-phi, phi}) {
          Vec corner{};
          corner[static_cast<std::size_t>((axis + 1) % 3)] = one;
          corner[static_cast<std::size_t>((axis + 2) % 3)] = long_side;
          mesh_.positions.push_back(corner);
        }
      }
    }
    const std::vector<Vec> corners = mesh_.positions;
    for (std::uint32_t a = 0; a < 12; ++a) {
      for (std::uint32_t b = a + 1; b < 12; ++b) {
        for (std::uint32_t c = b + 1; c < 12; ++c) add_if_face(corners, a, b, c);
      }
    }
    for (Vec& p : mesh_.positions) p = normalised(p);
  }

  codec::TriangleMesh take() { return std::move(mesh_); }

 private:
  void add_if_face(const std::vector<Vec>& corners, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const auto neighbours = [&](std::uint32_t i, std::uint32_t j) {
      const Vec d = corners[i] - corners[j];
      return dot(d, d) < 4.5;  // edges have length 2, the next distance is over 3
    };
    if (!neighbours(a, b) || !neighbours(b, c) || !neighbours(c, a)) return;
    const bool outward = dot(cross(corners[a], corners[b]), corners[c]) > 0;
    if (!outward) std::swap(b, c);
    std::vector<std::vector<std::uint32_t>> grid(n_ + 1);
    for (std::uint32_t i = 0; i <= n_; ++i) {
      for (std::uint32_t j = 0; i + j <= n_; ++j) grid[i].push_back(vertex(a, b, c, i, j));
    }
    for (std::uint32_t i = 0; i < n_; ++i) {
      for (std::uint32_t j = 0; i + j < n_; ++j) {
        mesh_.faces.push_back({grid[i][j], grid[i + 1][j], grid[i][j + 1]});
        if (i + j + 1 < n_) mesh_.faces.push_back({grid[i + 1][j], grid[i + 1][j + 1], grid[i][j + 1]});
      }
    }
  }

  /// The point i parts from a to b and j parts from a to c; shared with the neighbouring faces on an edge.
  std::uint32_t vertex(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t i, std::uint32_t j) {
    const std::uint32_t k = n_ - i - j;
    if (k == n_) return a;
    if (i == n_) return b;
    if (j == n_) return c;
    if (j == 0) return on_edge(a, b, i);
    if (i == 0) return on_edge(a, c, j);
    if (k == 0) return on_edge(b, c, j);
    const auto& p = mesh_.positions;
    return add(static_cast<double>(k) * p[a] + static_cast<double>(i) * p[b] + static_cast<double>(j) * p[c]);
  }

  std::uint32_t on_edge(std::uint32_t a, std::uint32_t b, std::uint32_t parts) {
    if (a > b) return on_edge(b, a, n_ - parts);
    std::vector<std::uint32_t>& edge = edges_[{a, b}];
    if (edge.empty()) {
      for (std::uint32_t k = 1; k < n_; ++k) {
        edge.push_back(
            add(static_cast<double>(n_ - k) * mesh_.positions[a] + static_cast<double>(k) * mesh_.positions[b]));
      }
    }
    return edge[parts - 1];
  }

  std::uint32_t add(const Vec& p) {
    mesh_.positions.push_back(p);
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  std::uint32_t n_;
  codec::TriangleMesh mesh_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> edges_;
};

/// The least height of each vertex's triangles.
std::vector<double> heights(const codec::TriangleMesh& mesh) {
  std::vector<double> least(mesh.positions.size(), 1);
  for (const codec::Face& f : mesh.faces) {
    const Vec a = mesh.positions[f[1]] - mesh.positions[f[0]];
    const Vec b = mesh.positions[f[2]] - mesh.positions[f[0]];
    const Vec c = b - a;
    const Vec normal = cross(a, b);
    const double height = std::sqrt(dot(normal, normal) / std::max({dot(a, a), dot(b, b), dot(c, c)}));
    for (const std::uint32_t v : f) least[v] = std::min(least[v], height);
  }
  return least;
}

/// Moves each vertex along the sphere by less than half the height of its triangles, so that none turns over.
void jitter(codec::TriangleMesh& mesh, std::uint64_t round) {
  const std::vector<double> height = heights(mesh);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    Vec& p = mesh.positions[v];
    const std::uint64_t key = 3 * v + (round << 40);
    const Vec random{hashed(key), hashed(key + 1), hashed(key + 2)};
    const Vec along = random - dot(random, p) * p;
    const double length = std::sqrt(dot(along, along));
    p = normalised(p + 0.45 * height[v] / std::max(length, 1.0) * along);
  }
}

/// Flips edges until the mesh of points on the sphere is convex, which is their Delaunay triangulation (Lawson).
class Flipper {
 public:
  explicit Flipper(codec::TriangleMesh& mesh) : mesh_(mesh), twin_(3 * mesh.faces.size()) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> edges;
    edges.reserve(twin_.size());
    for (std::uint32_t h = 0; h < twin_.size(); ++h) {
      const auto [low, high] = std::minmax(from(h), from(next(h)));
      edges.emplace_back(std::uint64_t{low} << 32 | high, h);
    }
    std::sort(edges.begin(), edges.end());
    for (std::size_t e = 0; e < edges.size(); e += 2) {
      pair(edges[e].second, edges[e + 1].second);
      waiting_.push_back(edges[e].second);
    }
  }

  void run() {
    while (!waiting_.empty()) {
      const std::uint32_t h = waiting_.back();
      waiting_.pop_back();
      if (is_concave(h)) flip(h);
    }
  }

 private:
  static std::uint32_t next(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
  std::uint32_t& from(std::uint32_t h) { return mesh_.faces[h / 3][h % 3]; }
  const Vec& at(std::uint32_t h) { return mesh_.positions[from(h)]; }
  void pair(std::uint32_t a, std::uint32_t b) {
    twin_[a] = b;
    twin_[b] = a;
  }

  bool is_concave(std::uint32_t h) {
    const Vec& a = at(h);
    const Vec& opposite = at(next(next(twin_[h])));
    const Vec normal = cross(at(next(h)) - a, at(next(next(h))) - a);
    const double length = std::sqrt(dot(normal, normal));
    return dot(normal, opposite - a) > 1e-12 * length;
  }

  /// The edge between a and b with c on its side and d across becomes the edge between c and d.
  void flip(std::uint32_t h) {
    const std::uint32_t t = twin_[h];
    const std::uint32_t h1 = next(h), h2 = next(h1), t1 = next(t), t2 = next(t1);
    const std::uint32_t beside_h1 = twin_[h1], beside_t1 = twin_[t1];
    const std::uint32_t c = from(h2), d = from(t2);
    from(h1) = d;  // faces are now (a, d, c) and (b, c, d), with the new edge at h1 and t1
    from(t1) = c;
    pair(h, beside_t1);
    pair(t, beside_h1);
    pair(h1, t1);
    for (const std::uint32_t edge : {h, h2, t, t2}) waiting_.push_back(edge);
  }

  codec::TriangleMesh& mesh_;
  std::vector<std::uint32_t> twin_;
  std::vector<std::uint32_t> waiting_;
};

/// Smooth noise with one random value a cell, from -1 to 1.
double noise(const Vec& p, std::uint64_t seed) {
  std::array<std::int64_t, 3> cell{};
  Vec weight{};
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

double mean_edge(const codec::TriangleMesh& mesh) {
  double sum = 0;
  for (const codec::Face& f : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec d = mesh.positions[f[k]] - mesh.positions[f[(k + 1) % 3]];
      sum += std::sqrt(dot(d, d));
    }
  }
  return sum / static_cast<double>(3 * mesh.faces.size());
}

/// Octaves of noise whose height falls as their wavelength, fading out between four edges and two; then a little of
/// its own for each vertex.
void displace(codec::TriangleMesh& mesh) {
  const double edge = mean_edge(mesh);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    Vec& p = mesh.positions[v];
    double radius = 1 + 0.03 * edge * hashed(0x1000000000000u + v);
    std::uint64_t octave = 1;
    for (double frequency = 2; frequency * edge < 0.5; frequency *= 2, ++octave) {
      const double fade = std::min(1.0, 0.5 / (frequency * edge) - 1);
      radius += 0.25 / frequency * fade * noise(frequency * p, octave << 56);
    }
    p = radius * p;
  }
}

double extent(const codec::TriangleMesh& mesh) {
  double most = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(mesh.positions.begin(), mesh.positions.end(),
                                                 [k](const Vec& a, const Vec& b) { return a[k] < b[k]; });
    most = std::max(most, (*high)[k] - (*low)[k]);
  }
  return most;
}

/// Of vertices that have not six neighbours.
double irregular_share(const codec::TriangleMesh& mesh) {
  std::vector<std::uint32_t> valence(mesh.positions.size());
  for (const codec::Face& f : mesh.faces) {
    for (const std::uint32_t v : f) ++valence[v];
  }
  const auto regular = std::count(valence.begin(), valence.end(), 6u);
  return 1 - static_cast<double>(regular) / static_cast<double>(valence.size());
}

int run(double vertices, const std::string& path) {
  const auto n = static_cast<std::uint32_t>(std::lround(std::sqrt((vertices - 2) / 10)));
  codec::TriangleMesh mesh = Icosphere(n).take();
  for (std::uint64_t round = 0; round < kRounds; ++round) {
    jitter(mesh, round);
    Flipper(mesh).run();
  }
  displace(mesh);
  for (Vec& p : mesh.positions) {
    for (double& coordinate : p) coordinate = static_cast<float>(coordinate);
  }
  const auto written = import::write_mesh(path, mesh);
  if (!written) {
    std::cerr << "bumpy_sphere: " << import::to_line(written.error()) << '\n';
    return 1;
  }
  std::cout << nlohmann::json{{"vertices", mesh.positions.size()},
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
