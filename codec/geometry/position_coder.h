// SPDX-License-Identifier: MIT
// The three coordinates of one vertex, one after the other. The expected covariance is an ellipsoid about the normal;
// each coordinate is expected given what is known of the two others (conditional Gaussian), the axis along which the
// normal is longest comes last. Lattice integers throughout: nothing is rotated, nothing is rounded twice.
// Gain: 0.65 to 1.1 bits a vertex (the project's codec notes, part 2).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "codec/geometry/coordinate_model.h"
#include "codec/geometry/predictor.h"
#include "codec/geometry/reflection.h"
#include "codec/geometry/value_counts.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

/// What the position coder codes by; encoder and decoder hold the same.
struct PositionModels {
  CoordinateModel first;              ///< positions
  CoordinateModel further;            ///< digits of positions that are known coarsely
  std::array<ValueCounts, 3> values;  ///< by axis, if structured
  Reflection reflection;              ///< of the mesh onto itself, if any axis flips
  Images images;                      ///< of the vertices that are known
  bool structured = false;            ///< the mesh repeats coordinates: look for them
};

/// Of the values that the ring suggests, the most frequent one: coordinates of its vertices (kind 0), corners of its
/// parallelograms (kind 1), middles between opposite vertices (kind 2). Answers how often it was met; 0: there is none.
inline std::size_t most_frequent(const Surface& surface, const Ring& ring, std::size_t axis, std::size_t kind,
                                 unsigned shift, std::int32_t& value) {
  std::array<std::int32_t, Ring::kMost> values{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < ring.size; ++i) {
    std::int32_t middle = surface[ring.vertex[i]].point[axis];
    if (kind == 1) {
      if (ring.apex[i] == kNone) continue;
      middle += surface[ring.vertex[ring.after(i)]].point[axis] - surface[ring.apex[i]].point[axis];
      if (middle < 0) continue;
    }
    if (kind == 2) {
      if (ring.border) return 0;
      const std::size_t opposite = i + ring.size / 2 < ring.size ? i + ring.size / 2 : i + ring.size / 2 - ring.size;
      middle = (middle + surface[ring.vertex[opposite]].point[axis] + 2) >> 1;
    }
    values[count++] = middle >> (shift + 1);
  }
  std::size_t most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t same = 1;
    for (std::size_t j = i + 1; j < count; ++j) same += values[j] == values[i] ? 1 : 0;
    if (same <= most) continue;
    most = same;
    value = values[i];
  }
  return most;
}

/// Of the images nearby, the one that fits best: coordinates of `order` before the i-th are known (`cell`), the others
/// are expected at `mean`. Answers how many fit about as well; 0: there is none.
inline std::size_t best_image(const Images::Nearby& nearby, const std::array<std::size_t, 3>& order, std::size_t i,
                              const LatticePoint& cell, const std::array<double, 3>& mean, double spread,
                              unsigned shift, std::int32_t& value) {
  const double inverse = 1 / (spread * spread + 0.5);
  double best = 40;
  std::size_t fitting = 0;
  for (std::size_t n = 0; n < nearby.size; ++n) {
    double away = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const std::int32_t at = nearby.image[n][order[j]] >> (shift + 1);
      if (j < i) {
        const auto off = static_cast<double>(at - cell[order[j]]);
        away += off * off * 3;
      } else {
        const double off = static_cast<double>(at) - mean[j];
        away += off * off * inverse;
      }
    }
    if (away < best + 3) fitting = away < best - 3 ? 1 : fitting + 1;
    if (away >= best) continue;
    best = away;
    value = nearby.image[n][order[i]] >> (shift + 1);
  }
  return fitting;
}

/// Codes the cell of a vertex, all its digits, or with `known` those below the cells that are known: `digits` of them.
/// `shift`: digits that the answer does not have. False: the packet is damaged.
template <typename Source>
bool code_position(PositionModels& models, Source& source, const Surface& surface, const Ring& ring,
                   const Expectation& expected, std::int32_t most, unsigned shift, const LatticePoint* known,
                   unsigned digits, const LatticePoint& wanted, LatticePoint& cell) {
  const std::array<double, 3> n = {expected.normal[0], expected.normal[1], expected.normal[2]};
  std::array<std::size_t, 3> axis = {0, 1, 2};
  auto longer = [&](std::size_t i, std::size_t j) { return n[i] * n[i] > n[j] * n[j]; };
  if (longer(axis[0], axis[1])) std::swap(axis[0], axis[1]);
  if (longer(axis[1], axis[2])) std::swap(axis[1], axis[2]);
  if (longer(axis[0], axis[1])) std::swap(axis[0], axis[1]);

  // All in cells. A coordinate that is known tells of the others what the ellipsoid allows, less its own rounding.
  constexpr double kRounding = 1.0 / 12;
  constexpr double kLeastVariance = 1e-3;
  const double inverse = 1.0 / static_cast<double>(expected.cell);
  const auto half = static_cast<double>((1u << shift) - 1);
  const auto tangential = static_cast<double>(expected.spread.tangential);
  const auto across = static_cast<double>(expected.spread.across);
  const double along = tangential * tangential;
  const double difference = across * across - along;
  auto covariance = [&](std::size_t i, std::size_t j) { return difference * n[axis[i]] * n[axis[j]]; };
  std::array<double, 3> mean{};
  std::array<double, 3> seen{};   // distance from the mean, of coordinates that are known somehow
  std::array<double, 3> noise{};  // its variance
  for (std::size_t i = 0; i < 3; ++i) {
    const double position =
        expected.origin[axis[i]] + static_cast<double>(expected.position[static_cast<int>(axis[i])]);
    mean[i] = (position - half) * inverse;
    if (known == nullptr) continue;
    const auto width = static_cast<double>(1u << digits);
    seen[i] = (*known)[axis[i]] * width + (width - 1) / 2 - mean[i];
    noise[i] = width * width * kRounding;
  }
  std::array<std::size_t, Mixture::kSpikes> outcome{};  // of the repeated values so far: 0 nothing yet, 1 hit, 2 not
  // Where both are looked for, images stand in for corners, which say little beside them.
  constexpr std::size_t kImages = 1;
  const bool reflects = known == nullptr && models.reflection.any();
  Images::Nearby nearby;
  if (reflects) {
    LatticePoint about{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double bounded = std::min(std::max(mean[i], 0.0), static_cast<double>(most));
      about[axis[i]] = static_cast<std::int32_t>(bounded) << (shift + 1);
    }
    nearby = models.images.near(about);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = i == 0 ? 1 : 0;
    const std::size_t k = i == 2 ? 1 : 2;
    double centre = mean[i];
    double variance = along + covariance(i, i);
    const double ij = covariance(i, j);
    const double ik = covariance(i, k);
    const double jj = along + covariance(j, j) + noise[j] + 1e-9;
    const double kk = along + covariance(k, k) + noise[k] + 1e-9;
    if (known != nullptr || i == 2) {
      const double jk = covariance(j, k);
      const double share = 1 / (jj * kk - jk * jk + 1e-9);
      const double gain_j = (ij * kk - ik * jk) * share;
      const double gain_k = (ik * jj - ij * jk) * share;
      centre += gain_j * seen[j] + gain_k * seen[k];
      variance -= gain_j * ij + gain_k * ik;
    } else if (i == 1) {
      const double gain = ij / jj;
      centre += gain * seen[j];
      variance -= gain * ij;
    }
    if (!(variance > kLeastVariance)) variance = kLeastVariance;
    if (!(centre > 0)) centre = 0;
    if (centre > most) centre = most;
    const double spread = std::sqrt(variance);

    std::int32_t value = 0;
    const std::int32_t want = wanted[axis[i]];
    if (known != nullptr) {
      Mixture mixture = models.further.mixture(centre, static_cast<float>(spread), i, {});
      value = models.further.code_digits(source, want, mixture, (*known)[axis[i]], digits);
    } else {
      std::array<RepeatedValue, Mixture::kSpikes> repeated{};
      const std::size_t kinds = models.structured ? repeated.size() : (reflects ? 1 : 0);
      for (std::size_t kind = 0; kind < kinds; ++kind) {
        std::size_t times = 0;
        if (reflects && (kinds == 1 || kind == kImages)) {
          times = best_image(nearby, axis, i, cell, mean, tangential, shift, repeated[kind].value);
        } else if (kind < 3) {
          times = most_frequent(surface, ring, axis[i], kind, shift, repeated[kind].value);
        } else {
          models.values[axis[i]].begin(shift);
          const std::size_t count = models.values[axis[i]].best_near(centre, 3 * spread + 1, repeated[kind].value);
          times = static_cast<std::size_t>(std::bit_width(count));
        }
        const double away = (repeated[kind].value - centre) / spread;
        const double distance = away < 0 ? -away : away;
        const std::size_t far = distance < 0.3 ? 0 : (distance < 1 ? 1 : (distance < 2.5 ? 2 : 3));
        repeated[kind].context = (std::min<std::size_t>(times, 7) * 3 + outcome[kind]) * 4 + far;
      }
      Mixture mixture = models.first.mixture(centre, static_cast<float>(spread), i, std::span(repeated).first(kinds));
      value = models.first.code(source, want, mixture, most);
      if (value < 0) return false;
      if (models.structured) models.values[axis[i]].learn(value);
      for (std::size_t kind = 0; kind < kinds; ++kind) outcome[kind] = repeated[kind].value == value ? 1 : 2;
    }
    cell[axis[i]] = value;
    seen[i] = value - mean[i];
    noise[i] = kRounding;
  }
  return true;
}

}  // namespace pmcd::codec
