// SPDX-License-Identifier: MIT
// The logistic distribution for models: a table built by the compiler from + - * / alone and read with linear
// interpolation, so that every IEEE build gets the same bits. Good to about four digits; not a math library.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "codec/entropy/softmax.h"

namespace pmcd::codec {

/// The logistic distribution function 1 / (1 + e^-t) times 2^24 as an integer that never falls when t grows. Four at a
/// time.
class LogisticTable {
 public:
  static FourInts at(Four t) {
    constexpr Four kMiddle = Four{} + kReach;
    constexpr Four kLast = Four{} + (2 * kReach - 0x1p-10f);
    constexpr Four kScale = Four{} + static_cast<float>(32 << kFractionBits);
    t = smaller(larger(t + kMiddle, Four{}), kLast);
    const FourInts position = __builtin_convertvector(t * kScale, FourInts);
    const FourInts step = position >> kFractionBits;
    const FourInts fraction = position & ((1 << kFractionBits) - 1);
    const FourInts first = two_steps(step[0], step[1]);
    const FourInts second = two_steps(step[2], step[3]);
    const FourInts low = __builtin_shufflevector(first, second, 0, 2, 4, 6);
    const FourInts rise = __builtin_shufflevector(first, second, 1, 3, 5, 7);
    return low + (dot_pairs(rise, fraction) >> (kFractionBits - kRiseBits));
  }

 private:
  static constexpr float kReach = 16;
  static constexpr int kFractionBits = 10;  // a step of the table is 1/32
  static constexpr int kRiseBits = 3;       // that rises lack, so that they take 16
  static constexpr std::size_t kSteps = 1024;

  struct Step {
    std::int32_t low;
    std::int32_t rise;  // to the next step's low
  };
  static constexpr std::array<Step, kSteps> kTable = [] {
    // e^-t by powers of e^-1/32.
    std::array<std::int32_t, kSteps + 1> value{};
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
      value[kSteps / 2 + i] = static_cast<std::int32_t>(above);
      value[kSteps / 2 - i] = static_cast<std::int32_t>(below);
      decay *= ratio;
    }
    std::array<Step, kSteps> table{};
    for (std::size_t i = 0; i < kSteps; ++i) table[i] = {value[i], (value[i + 1] - value[i]) >> kRiseBits};
    return table;
  }();

  static FourInts two_steps(std::int32_t a, std::int32_t b) {
    using TwoSteps = std::int64_t __attribute__((vector_size(16)));
    return (FourInts)TwoSteps{std::bit_cast<std::int64_t>(kTable[static_cast<std::size_t>(a)]),
                              std::bit_cast<std::int64_t>(kTable[static_cast<std::size_t>(b)])};
  }
};

}  // namespace pmcd::codec
