// SPDX-License-Identifier: MIT
#include "codec/encoder/reflection_search.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace pmcd::codec {
namespace {

constexpr std::size_t kSampledVertices = 1000;
// The share of vertices that must have an image for the search to pay.
constexpr double kWorthShare = 0.15;

LatticePoint in_halves(const LatticePoint& p) {
  return {2 * p[0], 2 * p[1], 2 * p[2]};
}

// Where vertices may be: a hashed bitmap of cells, which now and then says yes without reason. It spares most look-ups
// among images, each of 27 buckets.
class Occupied {
 public:
  explicit Occupied(std::size_t vertices) {
    std::size_t words = 1;
    while (words * 4 < vertices) words *= 2;
    words_.assign(words, 0);
  }

  void add(const LatticePoint& p) {
    const std::uint32_t bit = bit_of(p[0] >> kCell, p[1] >> kCell, p[2] >> kCell);
    words_[bit / 64] |= std::uint64_t{1} << bit % 64;
  }

  // Whether a vertex may stand within `off` of p on each axis.
  [[nodiscard]] bool near(const LatticePoint& p, std::int32_t off) const {
    for (std::int32_t x = (p[0] - off) >> kCell; x <= (p[0] + off) >> kCell; ++x) {
      for (std::int32_t y = (p[1] - off) >> kCell; y <= (p[1] + off) >> kCell; ++y) {
        for (std::int32_t z = (p[2] - off) >> kCell; z <= (p[2] + off) >> kCell; ++z) {
          const std::uint32_t bit = bit_of(x, y, z);
          if ((words_[bit / 64] >> bit % 64 & 1) != 0) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr int kCell = 3;  // of 8 half steps

  [[nodiscard]] std::uint32_t bit_of(std::int32_t x, std::int32_t y, std::int32_t z) const {
    const std::uint32_t mixed = static_cast<std::uint32_t>(x) * 73856093u ^ static_cast<std::uint32_t>(y) * 19349663u ^
                                static_cast<std::uint32_t>(z) * 83492791u;
    return (mixed ^ mixed >> 15) & static_cast<std::uint32_t>(64 * words_.size() - 1);
  }

  std::vector<std::uint64_t> words_;
};

// The share of a sample of vertices that have a vertex within a step of their image. `standing`: all vertices.
// 0 if the share cannot become more than `to_beat`.
double share_of(const Reflection& reflection, const Images& standing, const Occupied& occupied,
                std::span<const LatticePoint> points, double to_beat) {
  constexpr std::int32_t kStep = 2;
  const std::size_t stride = points.size() / kSampledVertices + 1;
  const std::size_t sampled = (points.size() + stride - 1) / stride;
  std::size_t hits = 0;
  auto share = [&](std::size_t of_them) { return static_cast<double>(of_them) / static_cast<double>(sampled); };
  for (std::size_t v = 0; v < points.size(); v += stride) {
    const std::size_t misses = v / stride - hits;
    if (share(sampled - misses) <= to_beat) return 0;
    const LatticePoint image = reflection.image(in_halves(points[v]));
    if (!occupied.near(image, kStep)) continue;
    const Images::Nearby nearby = standing.near(image);
    for (std::size_t i = 0; i < nearby.size; ++i) {
      std::int32_t off = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        off = std::max(off, std::abs(nearby.image[i][axis] - image[axis]));
      }
      if (off > kStep) continue;
      ++hits;
      break;
    }
  }
  return share(hits);
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
  Occupied occupied(points.size());
  for (const LatticePoint& p : points) {
    standing.add(in_halves(p));
    occupied.add(in_halves(p));
  }
  double best_share = kWorthShare;
  for (unsigned flips = 1; flips < 8; ++flips) {
    LatticePoint centre{};
    for (bool about_zero : {false, true}) {
      Reflection reflection;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        reflection.flips[axis] = (flips >> axis & 1) != 0;
        if (reflection.flips[axis]) reflection.sum[axis] = about_zero ? 4 * zero[axis] : 2 * (low[axis] + high[axis]);
      }
      if (about_zero && reflection.sum == centre) continue;
      if (!about_zero) centre = reflection.sum;
      const double share = share_of(reflection, standing, occupied, points, best_share);
      if (share <= best_share) continue;
      best_share = share;
      best = reflection;
    }
  }
  return best;
}

}  // namespace pmcd::codec
