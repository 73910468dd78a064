// SPDX-License-Identifier: MIT
#include "codec/geometry/spread.h"

#include "codec/entropy/real_tables.h"

namespace pmcd::codec {
namespace {

// Below a tenth of a cell nothing can be told apart.
constexpr double kFloor = 0.1;
constexpr LeastSquares<SpreadModel::kTerms, 2>::Tuning kTuning{0.999, 4, 32};
// A stranger's residual is like those of its ring, and a little smaller.
constexpr SpreadModel::Terms kTangentialPrior{-0.5, 0, 1, 0, 0, 0, 0, 0, 0};
constexpr SpreadModel::Terms kAcrossPrior{-0.5, 0, 0, 1, 0, 0, 0, 0, 0};

double bounded(double cells) {
  if (!(cells > 0.02)) return 0.02;
  return cells > 16777216.0 ? 16777216.0 : cells;
}

}  // namespace

SpreadModel::SpreadModel() : fit_(kTuning, {kTangentialPrior, kAcrossPrior}) {}

SpreadModel::Terms SpreadModel::terms(const Signs& signs, double inverse_cell) {
  auto logarithm = [&](double length) { return fast_log2(length * inverse_cell + kFloor); };
  return {1,
          logarithm(signs.radius),
          logarithm(signs.neighbours.tangential),
          logarithm(signs.neighbours.across),
          logarithm(signs.unevenness),
          logarithm(signs.parallelogram_across),
          logarithm(signs.parallelogram_tangential),
          logarithm(signs.crowding),
          logarithm(signs.bend)};
}

Spread SpreadModel::expect(const Terms& terms, std::size_t group) const {
  std::array<double, 2> logarithm{};
  for (std::size_t target = 0; target < 2; ++target) {
    for (std::size_t i = 0; i < kTerms; ++i) logarithm[target] += terms[i] * fit_.weight(target)[i];
  }
  const auto& calibration = calibration_[group];
  return {bounded(fast_exp2(logarithm[0]) * (calibration[0].actual / calibration[0].expected)),
          bounded(fast_exp2(logarithm[1]) * (calibration[1].actual / calibration[1].expected))};
}

void SpreadModel::learn(const Terms& terms, std::size_t group, const Spread& expected, const Spread& seen) {
  constexpr double kSeenFloor = 0.15;
  const std::array<double, 2> logarithm = {fast_log2(seen.tangential + kSeenFloor),
                                           fast_log2(seen.across + kSeenFloor)};
  fit_.observe(
      1, [&](std::size_t i, std::size_t j) { return terms[i] * terms[j]; },
      [&](std::size_t target, std::size_t i) { return terms[i] * logarithm[target]; });
  auto calibrate = [](Calibration& c, double cells, double guess) {
    constexpr double kDecay = 0.99;
    const double uncalibrated = guess * (c.expected / c.actual);
    c.actual = c.actual * kDecay + (cells + kFloor) / uncalibrated;
    c.expected = c.expected * kDecay + 1;
  };
  calibrate(calibration_[group][0], seen.tangential, expected.tangential);
  calibrate(calibration_[group][1], seen.across, expected.across);
}

}  // namespace pmcd::codec
