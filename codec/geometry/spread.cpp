// SPDX-License-Identifier: MIT
#include "codec/geometry/spread.h"

namespace pmcd::codec {
namespace {

// Below a tenth of a cell nothing can be told apart.
constexpr float kFloor = 0.1f;
constexpr LeastSquares<SpreadModel::kSigns + 1, 2>::Tuning kSpreadTuning{0.999f, 4, 64};
// A stranger's residual is like those of its ring, and a little smaller.
constexpr std::array<float, SpreadModel::kSigns + 1> kTangentialPrior{-0.5f, 0, 1, 0, 0, 0, 0, 0, 0};
constexpr std::array<float, SpreadModel::kSigns + 1> kAcrossPrior{-0.5f, 0, 0, 1, 0, 0, 0, 0, 0};

float bounded(float cells) {
  if (!(cells > 0.02f)) return 0.02f;
  return cells > 16777216.0f ? 16777216.0f : cells;
}

}  // namespace

SpreadModel::SpreadModel() : fit_(kSpreadTuning, {kTangentialPrior, kAcrossPrior}) {}

SpreadModel::Terms SpreadModel::terms(const Signs& signs, float inverse_cell) {
  Terms terms;
  const Four sizes{signs.radius, signs.neighbours.tangential, signs.neighbours.across, signs.unevenness};
  const Four bends{signs.parallelogram_across, signs.parallelogram_tangential, signs.crowding, signs.bend};
  const Four size_logs = fast_log2(sizes * inverse_cell + kFloor);
  const Four bend_logs = fast_log2(bends * inverse_cell + kFloor);
  terms.value = {1,
                 size_logs[0],
                 size_logs[1],
                 size_logs[2],
                 size_logs[3],
                 bend_logs[0],
                 bend_logs[1],
                 bend_logs[2],
                 bend_logs[3],
                 0,
                 0,
                 0};
  return terms;
}

Spread SpreadModel::expect(const Terms& terms, std::size_t group) const {
  std::array<float, 2> cells{};
  for (std::size_t target = 0; target < 2; ++target) {
    float logarithm = 0;
    for (std::size_t i = 0; i <= kSigns; ++i) logarithm += terms.value[i] * fit_.weight(target)[i];
    if (!(logarithm > -60.0f)) logarithm = -60;
    if (logarithm > 60.0f) logarithm = 60;
    const Calibration& calibration = calibration_[group][target];
    cells[target] = bounded(fast_exp2(logarithm) * (calibration.actual / calibration.expected));
  }
  return {cells[0], cells[1]};
}

void SpreadModel::learn(const Terms& terms, std::size_t group, const Spread& expected, const Spread& seen) {
  constexpr float kSeenFloor = 0.15f;
  Terms equation = terms;
  equation.value[kSigns + 1] = fast_log2(seen.tangential + kSeenFloor);
  equation.value[kSigns + 2] = fast_log2(seen.across + kSeenFloor);
  fit_.observe(1, {&equation, 1});
  auto calibrate = [](Calibration& c, float cells, float guess) {
    constexpr float kDecay = 0.99f;
    const float uncalibrated = guess * (c.expected / c.actual);
    c.actual = c.actual * kDecay + (cells + kFloor) / uncalibrated;
    c.expected = c.expected * kDecay + 1;
  };
  calibrate(calibration_[group][0], seen.tangential, expected.tangential);
  calibrate(calibration_[group][1], seen.across, expected.across);
}

}  // namespace pmcd::codec
