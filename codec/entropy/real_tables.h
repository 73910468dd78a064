// SPDX-License-Identifier: MIT
// log2, 2^x and the logistic distribution for models: tables built by the compiler from + - * / alone and read with
// linear interpolation, so that every IEEE build gets the same bits. Good to about four digits; not a math library.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "codec/entropy/softmax.h"

namespace pmcd::codec {

namespace real_tables {

inline constexpr std::size_t kLogSteps = 256;
inline constexpr std::size_t kPowerSteps = 256;

// ln((1 + u) / (1 - u)) = 2 (u + u^3/3 + ...); u is at most 1/3 here.
constexpr double natural_log(double x) {
  const double u = (x - 1) / (x + 1);
  double power = u;
  double sum = 0;
  for (int k = 1; k < 60; k += 2) {
    sum += power / k;
    power *= u * u;
  }
  return 2 * sum;
}

constexpr double natural_exp(double x) {  // x from -1 to 1
  double term = 1;
  double sum = 1;
  for (int k = 1; k < 30; ++k) {
    term = term * x / k;
    sum += term;
  }
  return sum;
}

inline constexpr double kLn2 = natural_log(2.0);

inline constexpr std::array<double, kLogSteps + 1> kLog2 = [] {
  std::array<double, kLogSteps + 1> table{};
  for (std::size_t i = 0; i <= kLogSteps; ++i) table[i] = natural_log(1 + static_cast<double>(i) / kLogSteps) / kLn2;
  return table;
}();

inline constexpr std::array<double, kPowerSteps + 1> kPower2 = [] {
  std::array<double, kPowerSteps + 1> table{};
  for (std::size_t i = 0; i <= kPowerSteps; ++i) table[i] = natural_exp(kLn2 * static_cast<double>(i) / kPowerSteps);
  return table;
}();

}  // namespace real_tables

/// log2(x). REQUIRES: x is normal and > 0. [a table look-up]
inline double fast_log2(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const int exponent = static_cast<int>(bits >> 52) - 1023;
  const std::size_t step = (bits >> 44) & 0xFF;
  const double rest = static_cast<double>(bits & 0xFFFFFFFFFFFu) * (1.0 / 17592186044416.0);
  const double low = real_tables::kLog2[step];
  return exponent + (low + (real_tables::kLog2[step + 1] - low) * rest);
}

/// 2^x, x clamped to -60 .. 60. [a table look-up]
inline double fast_exp2(double x) {
  if (!(x > -60)) x = -60;
  if (x > 60) x = 60;
  const double shifted = x + 64;
  const auto whole = static_cast<std::int64_t>(shifted);
  const double position = (shifted - static_cast<double>(whole)) * real_tables::kPowerSteps;
  const auto step = static_cast<std::size_t>(position);
  const double low = real_tables::kPower2[step];
  const double mantissa = low + (real_tables::kPower2[step + 1] - low) * (position - static_cast<double>(step));
  return mantissa * std::bit_cast<double>(static_cast<std::uint64_t>(whole - 64 + 1023) << 52);
}

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
    const double ratio = real_tables::natural_exp(-1.0 / 32);
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
