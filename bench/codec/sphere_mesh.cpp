// SPDX-License-Identifier: GPL-3.0-or-later
// The divided icosahedron, the moving and the flipping.
#include "bench/codec/sphere_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace pmcd::bench {
namespace {

using codec::Vec;

Vec normalised(const Vec& a) {
  return a * (1 / length(a));
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
          Vec corner;
          corner[static_cast<std::size_t>((axis + 1) % 3)] = one;
          corner[static_cast<std::size_t>((axis + 2) % 3)] = long_side;
          mesh_.points.push_back(corner);
        }
      }
    }
    const std::vector<Vec> corners = mesh_.points;
    for (std::uint32_t a = 0; a < 12; ++a) {
      for (std::uint32_t b = a + 1; b < 12; ++b) {
        for (std::uint32_t c = b + 1; c < 12; ++c) add_if_face(corners, a, b, c);
      }
    }
    for (Vec& p : mesh_.points) p = normalised(p);
  }

  SphereMesh take() { return std::move(mesh_); }

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
    const auto& p = mesh_.points;
    return add(p[a] * static_cast<double>(k) + p[b] * static_cast<double>(i) + p[c] * static_cast<double>(j));
  }

  std::uint32_t on_edge(std::uint32_t a, std::uint32_t b, std::uint32_t parts) {
    if (a > b) return on_edge(b, a, n_ - parts);
    std::vector<std::uint32_t>& edge = edges_[{a, b}];
    if (edge.empty()) {
      for (std::uint32_t k = 1; k < n_; ++k) {
        edge.push_back(add(mesh_.points[a] * static_cast<double>(n_ - k) + mesh_.points[b] * static_cast<double>(k)));
      }
    }
    return edge[parts - 1];
  }

  std::uint32_t add(const Vec& p) {
    mesh_.points.push_back(p);
    return static_cast<std::uint32_t>(mesh_.points.size() - 1);
  }

  std::uint32_t n_;
  SphereMesh mesh_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> edges_;
};

/// The least height of each vertex's triangles.
std::vector<double> heights(const SphereMesh& mesh) {
  std::vector<double> least(mesh.points.size(), 1);
  for (const codec::Face& f : mesh.faces) {
    const Vec a = mesh.points[f[1]] - mesh.points[f[0]];
    const Vec b = mesh.points[f[2]] - mesh.points[f[0]];
    const Vec c = b - a;
    const Vec normal = cross(a, b);
    const double height = std::sqrt(dot(normal, normal) / std::max({dot(a, a), dot(b, b), dot(c, c)}));
    for (const std::uint32_t v : f) least[v] = std::min(least[v], height);
  }
  return least;
}

/// Moves each vertex along the sphere by less than half the height of its triangles, so that none turns over.
void jitter(SphereMesh& mesh, std::uint64_t round) {
  const std::vector<double> height = heights(mesh);
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    Vec& p = mesh.points[v];
    const std::uint64_t key = 3 * v + (round << 40);
    const Vec random{hashed(key), hashed(key + 1), hashed(key + 2)};
    const Vec along = random - p * dot(random, p);
    p = normalised(p + along * (0.45 * height[v] / std::max(length(along), 1.0)));
  }
}

/// Flips edges until the mesh of points on the sphere is convex, which is their Delaunay triangulation (Lawson).
class Flipper {
 public:
  explicit Flipper(SphereMesh& mesh) : mesh_(mesh), twin_(3 * mesh.faces.size()) {
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
  const Vec& at(std::uint32_t h) { return mesh_.points[from(h)]; }
  void pair(std::uint32_t a, std::uint32_t b) {
    twin_[a] = b;
    twin_[b] = a;
  }

  bool is_concave(std::uint32_t h) {
    const Vec& a = at(h);
    const Vec& opposite = at(next(next(twin_[h])));
    const Vec normal = cross(at(next(h)) - a, at(next(next(h))) - a);
    return dot(normal, opposite - a) > 1e-12 * length(normal);
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

  SphereMesh& mesh_;
  std::vector<std::uint32_t> twin_;
  std::vector<std::uint32_t> waiting_;
};

}  // namespace

SphereMesh irregular_sphere(std::uint32_t n) {
  SphereMesh mesh = Icosphere(n).take();
  for (std::uint64_t round = 0; round < kRounds; ++round) {
    jitter(mesh, round);
    Flipper(mesh).run();
  }
  return mesh;
}

}  // namespace pmcd::bench
