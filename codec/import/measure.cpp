// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points by CGAL's AABB trees (faces, and slivers as segments) and its kd-tree (isolated vertices).
#include "codec/import/measure.h"

#include <CGAL/AABB_segment_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pmcd::import {
namespace {

using codec::Face;
using codec::Position;
using codec::TriangleMesh;

using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Segment = Kernel::Segment_3;
template <typename Item, template <class, class, class> class Primitive>
using Tree = CGAL::AABB_tree<
    CGAL::AABB_traits<Kernel, Primitive<Kernel, typename std::vector<Item>::const_iterator, CGAL::Tag_false>>>;
using TriangleTree = Tree<Triangle, CGAL::AABB_triangle_primitive>;
using SegmentTree = Tree<Segment, CGAL::AABB_segment_primitive>;
using Neighbours = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Kernel>>;

Point point(const Position& p) {
  return {p[0], p[1], p[2]};
}

class Surface {
 public:
  explicit Surface(const TriangleMesh& mesh) {
    std::vector<bool> used(mesh.positions.size(), false);
    for (const Face& face : mesh.faces) {
      for (const std::uint32_t v : face) used[v] = true;
      add_face(point(mesh.positions[face[0]]), point(mesh.positions[face[1]]), point(mesh.positions[face[2]]));
    }
    for (std::size_t v = 0; v < used.size(); ++v) {
      if (!used[v]) points_.push_back(point(mesh.positions[v]));
    }
    triangle_tree_.rebuild(triangles_.cbegin(), triangles_.cend());
    segment_tree_.rebuild(segments_.cbegin(), segments_.cend());
    point_tree_.insert(points_.begin(), points_.end());
    vertices_ = mesh.positions;
    // Adding zero makes -0.0 and +0.0 the same place.
    for (Position& p : vertices_) p = {p[0] + 0.0, p[1] + 0.0, p[2] + 0.0};
    std::sort(vertices_.begin(), vertices_.end());
  }

  [[nodiscard]] double squared_distance(const Position& p) const {
    // A vertex of the surface has distance 0; the trees would answer with the rounding errors of a projection.
    if (std::binary_search(vertices_.begin(), vertices_.end(), Position{p[0] + 0.0, p[1] + 0.0, p[2] + 0.0})) return 0;
    double best = std::numeric_limits<double>::infinity();
    const Point query = point(p);
    if (!triangles_.empty()) best = std::min(best, CGAL::squared_distance(query, triangle_tree_.closest_point(query)));
    if (!segments_.empty()) best = std::min(best, CGAL::squared_distance(query, segment_tree_.closest_point(query)));
    if (!points_.empty()) best = std::min(best, Neighbours(point_tree_, query, 1).begin()->second);
    return best;
  }

 private:
  /// Projecting onto the plane of a sliver is noise, so a face that is flatter than this becomes its longest side.
  void add_face(const Point& a, const Point& b, const Point& c) {
    constexpr double kFlattest = 1e-20;  // squared: height 1e-10 of the longest side
    const double cross = CGAL::cross_product(b - a, c - a).squared_length();
    const double ab = CGAL::squared_distance(a, b);
    const double bc = CGAL::squared_distance(b, c);
    const double ca = CGAL::squared_distance(c, a);
    const double longest = std::max({ab, bc, ca});
    if (cross > kFlattest * longest * longest) {
      triangles_.emplace_back(a, b, c);
    } else if (!(longest > 0)) {
      points_.push_back(a);
    } else {
      segments_.push_back(ab == longest ? Segment(a, b) : bc == longest ? Segment(b, c) : Segment(c, a));
    }
  }

  std::vector<Triangle> triangles_;
  std::vector<Segment> segments_;
  std::vector<Point> points_;
  std::vector<Position> vertices_;
  TriangleTree triangle_tree_;
  SegmentTree segment_tree_;
  Neighbours::Tree point_tree_;
};

}  // namespace

ErrorMeter::ErrorMeter(const TriangleMesh& original) {
  if (original.positions.empty()) return;
  Position low = original.positions.front();
  Position high = low;
  for (const Position& p : original.positions) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  diagonal_ = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
  const std::size_t n = original.positions.size();
  const std::size_t stride = (n + kMostSamples - 1) / kMostSamples;
  for (std::size_t v = 0; v < n; v += stride) samples_.push_back(original.positions[v]);
}

Distance ErrorMeter::distance_to(const TriangleMesh& surface) const {
  if (samples_.empty()) return {};
  if (surface.positions.empty()) {
    return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  const Surface target(surface);
  double sum = 0;
  double largest = 0;
  for (const Position& p : samples_) {
    const double squared = target.squared_distance(p);
    sum += squared;
    largest = std::max(largest, squared);
  }
  const double unit = diagonal_ > 0 ? diagonal_ : 1;
  return {std::sqrt(sum / static_cast<double>(samples_.size())) / unit, std::sqrt(largest) / unit};
}

}  // namespace pmcd::import
