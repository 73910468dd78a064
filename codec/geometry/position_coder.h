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
#include "codec/geometry/repeats.h"
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
  // Repeated values are looked for unless digits are known, which say more. Where both are looked for, images stand in
  // for corners, which say little beside them.
  constexpr std::size_t kImages = static_cast<std::size_t>(Repeat::corner);
  const bool reflects = known == nullptr && models.reflection.any();
  std::size_t kinds = 0;
  std::array<Repeated, kRepeats> most_often;
  Images::Nearby nearby;
  if (reflects) {
    kinds = 1;
    LatticePoint about{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double bounded = std::min(std::max(mean[i], 0.0), static_cast<double>(most));
      about[axis[i]] = static_cast<std::int32_t>(bounded) << (shift + 1);
    }
    nearby = models.images.near(about);
  }
  if (models.structured && known == nullptr) {
    kinds = Mixture::kSpikes;
    for (std::size_t kind = 0; kind < kRepeats; ++kind) {
      if (reflects && kind == kImages) continue;
      most_often[kind] = most_frequent(surface, ring, static_cast<Repeat>(kind), shift);
    }
  }
  std::array<std::size_t, Mixture::kSpikes> outcome{};  // of the repeated values so far: 0 nothing yet, 1 hit, 2 not
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
      const auto spread_squared = static_cast<float>(variance);
      std::array<RepeatedValue, Mixture::kSpikes> repeated{};
      for (std::size_t kind = 0; kind < kinds; ++kind) {
        std::size_t times = 0;
        if (reflects && (kinds == 1 || kind == kImages)) {
          times = best_image(nearby, axis, i, cell, mean, tangential, shift, repeated[kind].value);
        } else if (kind < kRepeats) {
          const int lane = static_cast<int>(axis[i]);
          times = static_cast<std::size_t>(most_often[kind].times[lane]);
          repeated[kind].value = most_often[kind].value[lane];
        } else {
          models.values[axis[i]].begin(shift);
          const std::size_t count = models.values[axis[i]].best_near(centre, 3 * spread + 1, repeated[kind].value);
          times = static_cast<std::size_t>(std::bit_width(count));
        }
        const auto away = static_cast<float>(repeated[kind].value - centre);
        const float square = away * away;
        // Hard to foresee, so there is no branch.
        const std::size_t far = (square >= 0.09f * spread_squared ? 1u : 0u) + (square >= spread_squared ? 1u : 0u) +
                                (square >= 6.25f * spread_squared ? 1u : 0u);
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
