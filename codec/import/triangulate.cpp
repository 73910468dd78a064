// SPDX-License-Identifier: GPL-3.0-or-later
// Ear clipping with a memory of the mesh's edges.
#include "codec/import/triangulate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace pmcd::import {
namespace {

using codec::Face;
using codec::Position;

constexpr std::size_t kMostEarCorners = 1024;  // beyond, clipping's quadratic time would show; such polygons are fanned

/// Undirected edges in one flat open-addressed table that never grows.
class EdgeSet {
 public:
  explicit EdgeSet(std::size_t most) : slots_(std::bit_ceil(2 * most + 2), kNone) {}
  void insert(std::uint32_t a, std::uint32_t b) { slots_[slot(a, b)] = key(a, b); }
  [[nodiscard]] bool contains(std::uint32_t a, std::uint32_t b) const { return slots_[slot(a, b)] != kNone; }

 private:
  static constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
  }
  [[nodiscard]] std::size_t slot(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t wanted = key(a, b);
    std::uint64_t mixed = (wanted ^ wanted >> 29) * 0x9e3779b97f4a7c15u;
    mixed ^= mixed >> 32;
    std::size_t at = mixed & (slots_.size() - 1);
    while (slots_[at] != kNone && slots_[at] != wanted) at = (at + 1) & (slots_.size() - 1);
    return at;
  }
  std::vector<std::uint64_t> slots_;
};

using Point2 = std::array<double, 2>;

double twice_area(const Point2& a, const Point2& b, const Point2& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

double squared_distance(const Position& a, const Position& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return x * x + y * y + z * z;
}

// How good it is to clip a corner; lower is better.
enum Tier : std::uint8_t { kEar, kNoEar, kEarOnEdge, kNoEarOnEdge };

class Clipper {
 public:
  Clipper(std::span<const Position> positions, EdgeSet& edges) : positions_(positions), edges_(edges) {}

  /// Appends polygon.size() - 2 faces and remembers their diagonals.
  void clip(std::span<const std::uint32_t> polygon, Triangulation& out) {
    ++out.polygons;
    const std::size_t first_face = out.faces.size();
    if (polygon.size() > kMostEarCorners) {
      fan(polygon, 0, out.faces);
      ++out.not_simple;
    } else {
      project(polygon);
      clip_ears(polygon, out.faces);
      if (on_edge_) try_fans(polygon, first_face, out.faces);
      if (forced_) ++out.not_simple;
      if (avoided_) ++out.diagonals_avoided;
    }
    for (std::size_t f = first_face; f < out.faces.size(); ++f) {
      for (std::size_t c = 0; c < 3; ++c) edges_.insert(out.faces[f][c], out.faces[f][(c + 1) % 3]);
    }
  }

 private:
  struct Corner {
    std::size_t previous;
    std::size_t next;
    Tier tier;
    bool convex;
    double length;  ///< squared, of the diagonal
  };

  /// Onto the coordinate plane that the polygon's plane is least inclined to, counter-clockwise there.
  void project(std::span<const std::uint32_t> polygon) {
    Position normal{0, 0, 0};
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Position& p = positions_[polygon[i]];
      const Position& q = positions_[polygon[(i + 1) % polygon.size()]];
      const Position& o = positions_[polygon[0]];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t u = (k + 1) % 3;
        const std::size_t v = (k + 2) % 3;
        normal[k] += (p[u] - o[u]) * (q[v] - o[v]) - (p[v] - o[v]) * (q[u] - o[u]);
      }
    }
    std::size_t drop = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (std::abs(normal[k]) > std::abs(normal[drop])) drop = k;
    }
    std::size_t u = (drop + 1) % 3;
    std::size_t v = (drop + 2) % 3;
    if (normal[drop] < 0) std::swap(u, v);
    flat_.resize(polygon.size());
    for (std::size_t i = 0; i < polygon.size(); ++i) flat_[i] = {positions_[polygon[i]][u], positions_[polygon[i]][v]};
  }

  void clip_ears(std::span<const std::uint32_t> polygon, std::vector<Face>& faces) {
    forced_ = on_edge_ = avoided_ = false;
    const std::size_t n = polygon.size();
    corners_.resize(n);
    for (std::size_t i = 0; i < n; ++i) corners_[i] = {(i + n - 1) % n, (i + 1) % n, kEar, false, 0};
    for (std::size_t i = 0; i < n; ++i) corners_[i].convex = is_convex(i);
    std::size_t start = 0;
    for (std::size_t i = 0; i < n; ++i) judge(polygon, i, start);
    for (std::size_t left = n; left > 3; --left) {
      std::size_t best = start;
      double shortest_ear_on_edge = std::numeric_limits<double>::infinity();
      std::size_t i = start;
      do {
        const Corner& c = corners_[i];
        const Corner& b = corners_[best];
        // A length that is not a number (coordinates near the end of double's range) loses against every other.
        if (c.tier < b.tier || (c.tier == b.tier && c.length < b.length)) best = i;
        if (c.tier == kEarOnEdge) shortest_ear_on_edge = std::min(shortest_ear_on_edge, c.length);
        i = c.next;
      } while (i != start);
      const Corner chosen = corners_[best];
      if (chosen.tier == kNoEar || chosen.tier == kNoEarOnEdge) forced_ = true;
      if (chosen.tier == kEarOnEdge || chosen.tier == kNoEarOnEdge) on_edge_ = true;
      if (chosen.tier == kEar || chosen.tier == kNoEar) {
        avoided_ = avoided_ || shortest_ear_on_edge < chosen.length ||
                   (chosen.tier == kNoEar && std::isfinite(shortest_ear_on_edge));
      }
      faces.push_back({polygon[chosen.previous], polygon[best], polygon[chosen.next]});
      corners_[chosen.previous].next = chosen.next;
      corners_[chosen.next].previous = chosen.previous;
      start = chosen.next;
      for (const std::size_t neighbour : {chosen.previous, chosen.next}) {
        corners_[neighbour].convex = is_convex(neighbour);
      }
      for (const std::size_t neighbour : {chosen.previous, chosen.next}) judge(polygon, neighbour, start);
    }
    const Corner& last = corners_[start];
    faces.push_back({polygon[last.previous], polygon[start], polygon[last.next]});
  }

  [[nodiscard]] bool is_convex(std::size_t i) const {
    return twice_area(flat_[corners_[i].previous], flat_[i], flat_[corners_[i].next]) > 0;
  }

  void judge(std::span<const std::uint32_t> polygon, std::size_t i, std::size_t start) {
    Corner& c = corners_[i];
    const bool on_edge = edges_.contains(polygon[c.previous], polygon[c.next]);
    const bool ear = c.convex && is_empty(i, start);
    c.tier = ear ? (on_edge ? kEarOnEdge : kEar) : (on_edge ? kNoEarOnEdge : kNoEar);
    c.length = squared_distance(positions_[polygon[c.previous]], positions_[polygon[c.next]]);
  }

  /// No reflex corner of what is left lies in the triangle at corner i, its border included.
  [[nodiscard]] bool is_empty(std::size_t i, std::size_t start) const {
    const Point2& a = flat_[corners_[i].previous];
    const Point2& b = flat_[i];
    const Point2& c = flat_[corners_[i].next];
    std::size_t j = start;
    do {
      if (!corners_[j].convex && j != i && j != corners_[i].previous && j != corners_[i].next) {
        const Point2& p = flat_[j];
        const bool at_a_corner = p == a || p == b || p == c;
        if (!at_a_corner && twice_area(a, b, p) >= 0 && twice_area(b, c, p) >= 0 && twice_area(c, a, p) >= 0) {
          return false;
        }
      }
      j = corners_[j].next;
    } while (j != start);
    return true;
  }

  static void fan(std::span<const std::uint32_t> polygon, std::size_t apex, std::vector<Face>& faces) {
    const std::size_t n = polygon.size();
    for (std::size_t i = 1; i + 1 < n; ++i) {
      faces.push_back({polygon[apex], polygon[(apex + i) % n], polygon[(apex + i + 1) % n]});
    }
  }

  /// Clipping ran into an edge of the mesh; the first fan that does not is taken instead.
  void try_fans(std::span<const std::uint32_t> polygon, std::size_t first_face, std::vector<Face>& faces) {
    const std::size_t n = polygon.size();
    for (std::size_t apex = 0; apex < n; ++apex) {
      bool free = true;
      for (std::size_t i = 2; i + 1 < n && free; ++i) free = !edges_.contains(polygon[apex], polygon[(apex + i) % n]);
      if (!free) continue;
      faces.resize(first_face);
      fan(polygon, apex, faces);
      avoided_ = true;
      forced_ = true;
      return;
    }
  }

  std::span<const Position> positions_;
  EdgeSet& edges_;
  std::vector<Point2> flat_;
  std::vector<Corner> corners_;
  bool forced_ = false;   ///< a corner was clipped that is no ear
  bool on_edge_ = false;  ///< a diagonal is an edge that the mesh already has
  bool avoided_ = false;  ///< a better diagonal was not taken because the mesh has it already
};

}  // namespace

Triangulation triangulate(std::span<const Position> positions, std::span<const std::uint32_t> corners,
                          std::span<const std::uint32_t> polygon_end) {
  Triangulation out;
  out.faces.reserve(corners.size() - std::min(corners.size(), 2 * polygon_end.size()));
  if (corners.size() == 3 * polygon_end.size()) {
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      out.faces.push_back({corners[i], corners[i + 1], corners[i + 2]});
    }
    return out;
  }
  out.polygon.reserve(out.faces.capacity());
  EdgeSet edges(2 * corners.size());  // n edges and n - 3 diagonals a polygon
  std::size_t begin = 0;
  for (const std::uint32_t end : polygon_end) {
    for (std::size_t i = begin; i < end; ++i) edges.insert(corners[i], corners[i + 1 < end ? i + 1 : begin]);
    begin = end;
  }
  Clipper clipper(positions, edges);
  begin = 0;
  for (std::size_t p = 0; p < polygon_end.size(); ++p) {
    const std::span<const std::uint32_t> polygon = corners.subspan(begin, polygon_end[p] - begin);
    if (polygon.size() == 3) {
      out.faces.push_back({polygon[0], polygon[1], polygon[2]});
    } else {
      clipper.clip(polygon, out);
    }
    out.polygon.resize(out.faces.size(), static_cast<std::uint32_t>(p));
    begin = polygon_end[p];
  }
  return out;
}

}  // namespace pmcd::import
