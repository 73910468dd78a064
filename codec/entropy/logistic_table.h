// SPDX-License-Identifier: MIT
// The logistic distribution for models: a table built by the compiler from + - * / alone and read with linear
// interpolation, so that every IEEE build gets the same bits. Good to about four digits; not a math library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/entropy/softmax.h"

namespace pmcd::codec {

/// The logistic distribution function 1 / (1 + e^-t) times 2^24 as an integer that never falls when t grows. Four at a
/// time.
class LogisticTable {
 public:
  using FourInts = std::int32_t __attribute__((vector_size(16)));

  static FourInts at(Four t) {
    constexpr float kLast = 2 * kReach - 0x1p-10f;
    t += kReach;
    t = t > 0.0f ? t : Four{};
    t = t < kLast ? t : Four{} + kLast;
    const FourInts position = __builtin_convertvector(t * static_cast<float>(32 << kFractionBits), FourInts);
    const FourInts step = position >> kFractionBits;
    const FourInts fraction = position & ((1 << kFractionBits) - 1);
    const FourInts low = look_up(kTable, step);
    const FourInts rise = look_up(kRise, step);
    return low + ((rise * fraction) >> kFractionBits);
  }

 private:
  static constexpr float kReach = 16;
  static constexpr int kFractionBits = 10;  // a step of the table is 1/32
  static constexpr std::size_t kSteps = 1024;

  static constexpr std::array<std::int32_t, kSteps + 1> kTable = [] {
    // e^-t by powers of e^-1/32.
    std::array<std::int32_t, kSteps + 1> table{};
    double term = 1;
    double ratio = 1;  // e^-1/32 by its series
    for (int k = 1; k < 30; ++k) {
      term = term * (-1.0 / 32) / k;
      ratio += term;
    }
    double decay = 1;  // e^-t for t >= 0
    for (std::size_t i = 0; i <= kSteps / 2; ++i) {
      const double upper = 1 / (1 + decay);
      const double above = upper * 16777216.0 + 0.5;
      const double below = (1 - upper) * 16777216.0 + 0.5;
      table[kSteps / 2 + i] = static_cast<std::int32_t>(above);
      table[kSteps / 2 - i] = static_cast<std::int32_t>(below);
      decay *= ratio;
    }
    return table;
  }();
  static constexpr std::array<std::int32_t, kSteps> kRise = [] {
    std::array<std::int32_t, kSteps> rise{};
    for (std::size_t i = 0; i < kSteps; ++i) rise[i] = kTable[i + 1] - kTable[i];
    return rise;
  }();

  template <typename Table>
  static FourInts look_up(const Table& table, FourInts step) {
    auto at_lane = [&](int lane) { return table[static_cast<std::size_t>(step[lane])]; };
    return FourInts{at_lane(0), at_lane(1), at_lane(2), at_lane(3)};
  }
};

}  // namespace pmcd::codec
