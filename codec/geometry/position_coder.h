// SPDX-License-Identifier: MIT
// The three coordinates of one vertex, one after the other. The expected covariance is an ellipsoid about the normal;
// each coordinate is expected given what is known of the two others (conditional Gaussian), the axis along which the
// normal is longest comes last. Lattice integers throughout: nothing is rotated, nothing is rounded twice.
// Gain: 0.65 to 1.1 bits a vertex (the project's codec notes, part 2).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "codec/geometry/coordinate_model.h"
#include "codec/geometry/predictor.h"
#include "codec/geometry/repeated_values.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

/// What the position coder codes by; encoder and decoder hold the same.
struct PositionModels {
  CoordinateModel first;    ///< positions
  CoordinateModel further;  ///< digits of positions that are known coarsely
  Repetition repetition;
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
  // Where digits are known these say more than repeated values do.
  std::optional<RepeatedValues> repeats;
  if (known == nullptr && models.repetition.any()) {
    repeats.emplace(models.repetition, surface, ring, axis, mean, most, shift);
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
      std::span<const RepeatedValue> repeated;
      if (repeats) repeated = repeats->expect(i, centre, spread, cell, tangential);
      Mixture mixture = models.first.mixture(centre, static_cast<float>(spread), i, repeated);
      value = models.first.code(source, want, mixture, most);
      if (value < 0) return false;
      if (repeats) repeats->learn(i, value);
    }
    cell[axis[i]] = value;
    seen[i] = value - mean[i];
    noise[i] = kRounding;
  }
  return true;
}

}  // namespace pmcd::codec
