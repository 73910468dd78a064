// SPDX-License-Identifier: MIT
#include "codec/encoder/reflection_search.h"

#include <algorithm>
#include <cstdlib>

namespace pmcd::codec {
namespace {

constexpr std::size_t kSampledVertices = 1000;
// The share of vertices that must have an image for the search to pay.
constexpr double kWorthShare = 0.15;

LatticePoint in_halves(const LatticePoint& p) {
  return {2 * p[0], 2 * p[1], 2 * p[2]};
}

// The share of a sample of vertices that have a vertex within a step of their image. `standing`: all vertices.
double share_of(const Reflection& reflection, const Images& standing, std::span<const LatticePoint> points) {
  std::size_t hits = 0;
  std::size_t tried = 0;
  for (std::size_t v = 0; v < points.size(); v += points.size() / kSampledVertices + 1) {
    const LatticePoint image = reflection.image(in_halves(points[v]));
    ++tried;
    const Images::Nearby nearby = standing.near(image);
    for (std::size_t i = 0; i < nearby.size; ++i) {
      std::int32_t off = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        off = std::max(off, std::abs(nearby.image[i][axis] - image[axis]));
      }
      if (off > 2) continue;
      ++hits;
      break;
    }
  }
  return static_cast<double>(hits) / static_cast<double>(std::max<std::size_t>(1, tried));
}

}  // namespace

Reflection find_reflection(std::span<const LatticePoint> points, std::int32_t most, const LatticePoint& zero) {
  Reflection best;
  if (points.empty()) return best;
  LatticePoint low = points[0];
  LatticePoint high = points[0];
  for (const LatticePoint& p : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  Images standing;  // under no reflection: vertices themselves
  standing.begin({}, points.size(), 2 * most);
  for (const LatticePoint& p : points) standing.add(in_halves(p));
  double best_share = kWorthShare;
  for (unsigned flips = 1; flips < 8; ++flips) {
    for (bool about_zero : {false, true}) {
      Reflection reflection;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        reflection.flips[axis] = (flips >> axis & 1) != 0;
        if (reflection.flips[axis]) reflection.sum[axis] = about_zero ? 4 * zero[axis] : 2 * (low[axis] + high[axis]);
      }
      const double share = share_of(reflection, standing, points);
      if (share <= best_share) continue;
      best_share = share;
      best = reflection;
    }
  }
  return best;
}

}  // namespace pmcd::codec
