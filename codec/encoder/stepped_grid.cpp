// SPDX-License-Identifier: MIT
#include "codec/encoder/stepped_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "codec/lattice/ordered_float.h"

namespace pmcd::codec {
namespace {

// Different values an axis that are looked at, those nearest to zero: there the roundings are finest.
constexpr std::size_t kMostValues = 20000;
constexpr std::size_t kFewestValues = 16;
// Guesses of a step.
constexpr std::size_t kGuesses = 24;
// Of the gaps, how many must be multiples of a step.
constexpr double kWorthOfGrid = 0.6;

struct Gap {
  double size = 0;
  double blur = 0;
};

double blur_of(double value, const Decimals* fine, Scalar scalar) {
  if (fine != nullptr) {
    const std::int64_t number = first_from(*fine, value);
    return (value_of(*fine, number + 1) - value_of(*fine, number - 1)) / 4;
  }
  // Floats were computed rather than rounded once; and a double's own roundings come on top.
  const std::int64_t ordered = to_ordered(std::abs(value), scalar);
  return (from_ordered(ordered + 1, scalar) - from_ordered(ordered, scalar)) * 2;
}

std::vector<RoundedValue> different_values(const TriangleMesh& mesh, std::size_t axis, const Decimals* fine) {
  std::vector<double> all;
  all.reserve(mesh.positions.size());
  for (const Position& p : mesh.positions) all.push_back(p[axis]);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  if (all.size() > kMostValues) {
    std::nth_element(all.begin(), all.begin() + kMostValues, all.end(),
                     [](double a, double b) { return std::abs(a) < std::abs(b); });
    all.resize(kMostValues);
    std::sort(all.begin(), all.end());
  }
  std::vector<RoundedValue> values;
  values.reserve(all.size());
  const double least = all.empty() ? 0 : std::max(std::abs(all.front()), std::abs(all.back())) * 0x1p-51;
  for (double value : all) values.push_back({value, std::max(least, blur_of(value, fine, mesh.scalar))});
  return values;
}

// Makes a guessed step precise by gaps, sharp ones first; the share of gaps that are multiples of it. A gap that could
// be either of two multiples is left out until the step is precise enough.
double refine(std::span<const Gap> gaps, const Gap& guess, double& step) {
  step = guess.size;
  double down = 1 / (guess.blur * guess.blur);
  double up = guess.size * down;
  double share = 0;
  for (int round = 0; round < 3; ++round) {
    std::size_t hits = 0;
    std::size_t tried = 0;
    for (const Gap& gap : gaps) {
      const auto n = static_cast<double>(whole_below(gap.size / step + 0.5));
      const double slack = gap.blur + n * 2 / std::sqrt(down);
      if (slack > step / 5) continue;
      ++tried;
      if (std::abs(gap.size - n * step) > slack || n < 1) {
        if (tried > 50 && hits * 2 < tried) return 0;
        continue;
      }
      ++hits;
      if (round > 0) continue;
      const double weight = 1 / (gap.blur * gap.blur);
      up += weight * gap.size * n;
      down += weight * n * n;
      step = up / down;
    }
    share = tried < kFewestValues ? 0 : static_cast<double>(hits) / static_cast<double>(tried);
  }
  return share;
}

}  // namespace

SteppedGridSearch::SteppedGridSearch(const TriangleMesh& mesh, const Decimals* fine) {
  for (std::size_t axis = 0; axis < 3; ++axis) sharp_[axis] = different_values(mesh, axis, fine);
}

std::optional<SteppedGrid> SteppedGridSearch::find(double blur) const {
  std::array<std::vector<RoundedValue>, 3> values = sharp_;
  std::vector<Gap> gaps;
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (RoundedValue& value : values[axis]) value.blur += blur;
    for (std::size_t i = 1; i < values[axis].size(); ++i) {
      const RoundedValue& a = values[axis][i - 1];
      const RoundedValue& b = values[axis][i];
      gaps.push_back({b.value - a.value, a.blur + b.blur});
      extent = std::max(extent, values[axis].back().value - values[axis].front().value);
    }
  }
  // Gaps that are sharp; guesses are small ones among the sharpest.
  std::erase_if(gaps, [](const Gap& gap) { return gap.blur * 6 > gap.size || gap.blur <= 0; });
  if (gaps.size() < kFewestValues) return std::nullopt;
  std::vector<Gap> guesses;
  for (const Gap& gap : gaps) {
    if (gap.blur * 40 < gap.size) guesses.push_back(gap);
  }
  std::sort(guesses.begin(), guesses.end(), [](const Gap& a, const Gap& b) { return a.size < b.size; });
  std::sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.blur < b.blur; });
  double best_step = 0;
  double best_share = kWorthOfGrid;
  for (std::size_t guess = 0; guess < kGuesses && !guesses.empty(); ++guess) {
    double step = 0;
    const double share = refine(gaps, guesses[guess * guess * guesses.size() / (kGuesses * kGuesses * 4)], step);
    if (share > best_share + 0.02) {
      best_share = share;
      best_step = step;
    }
  }
  if (best_step == 0 || best_step * 64 > extent) return std::nullopt;

  // A common step and an origin per axis, by weighted least squares about each axis' sharpest value, from near to far.
  SteppedGrid grid;
  grid.step = best_step;
  struct Point {
    double distance;  // from the anchor
    double weight;
    std::size_t axis;
  };
  std::array<double, 3> anchor{};
  std::vector<Point> points;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (values[axis].empty()) continue;
    const auto sharpest =
        std::min_element(values[axis].begin(), values[axis].end(),
                         [](const RoundedValue& a, const RoundedValue& b) { return a.blur < b.blur; });
    anchor[axis] = sharpest->value;
    for (const RoundedValue& v : values[axis]) points.push_back({v.value - anchor[axis], 1 / (v.blur * v.blur), axis});
  }
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return std::abs(a.distance) < std::abs(b.distance); });
  struct Sums {
    double w = 0, k = 0, x = 0, kk = 0, kx = 0;
  };
  std::array<Sums, 3> sums;
  std::array<double, 3> offset{};
  std::size_t used = 0;
  for (const Point& p : points) {
    const auto k = static_cast<double>(whole_below((p.distance - offset[p.axis]) / grid.step + 0.5));
    const double off = p.distance - offset[p.axis] - k * grid.step;
    if (std::abs(off) > grid.step * 0.3) continue;
    Sums& s = sums[p.axis];
    s.w += p.weight;
    s.k += p.weight * k;
    s.x += p.weight * p.distance;
    s.kk += p.weight * k * k;
    s.kx += p.weight * k * p.distance;
    ++used;
    if (used < 32 || (used % 64 != 0 && used + 64 < points.size())) continue;
    double up = 0;
    double down = 0;
    for (const Sums& a : sums) {
      if (a.w <= 0) continue;
      up += a.kx - a.k * a.x / a.w;
      down += a.kk - a.k * a.k / a.w;
    }
    if (down <= 0) continue;
    grid.step = up / down;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (sums[axis].w > 0) offset[axis] = (sums[axis].x - grid.step * sums[axis].k) / sums[axis].w;
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) grid.origin[axis] = anchor[axis] + offset[axis];
  if (!valid(grid)) return std::nullopt;
  return grid;
}

}  // namespace pmcd::codec
