// SPDX-License-Identifier: MIT
// The tables behind the models: near enough to the functions that they stand for, never falling, defined for every
// double, and the same bits from every compiler.
#include "codec/entropy/real_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "codec/packet/hash.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double power_of_two(int exponent) {
  return std::ldexp(1.0, exponent);
}

TEST(RealTables, Log2IsNear) {
  Random random(1);
  for (int exponent = -1022; exponent <= 1023; ++exponent) {
    EXPECT_EQ(fast_log2(power_of_two(exponent)), exponent);
    const double x = power_of_two(exponent) * (1 + random.unit());
    EXPECT_NEAR(fast_log2(x), std::log2(x), 3e-6) << x;
  }
  // A chord lies below the curve, and least well in the middle of the first step.
  for (int i = 0; i <= 5120; ++i) {
    const double x = 1 + i / 5120.0;
    EXPECT_NEAR(fast_log2(x), std::log2(x), 3e-6) << x;
  }
}

TEST(RealTables, Exp2IsNearAndClamped) {
  for (int i = -60 * 512; i <= 60 * 512; ++i) {
    const double x = i / 512.0 + (i % 3) / 1536.0;
    if (x > 60) continue;
    EXPECT_NEAR(fast_exp2(x) / std::exp2(x), 1, 2e-6) << x;
  }
  for (int whole = -60; whole <= 60; ++whole) EXPECT_EQ(fast_exp2(whole), power_of_two(whole));
  for (double x : {-60.5, -1e300, -kInfinity, kNan}) EXPECT_EQ(fast_exp2(x), power_of_two(-60)) << x;
  for (double x : {60.5, 1e300, kInfinity}) EXPECT_EQ(fast_exp2(x), power_of_two(60)) << x;
  EXPECT_LE(fast_exp2(std::nextafter(1.0, 0.0)), 2);
  EXPECT_LE(fast_exp2(std::nextafter(60.0, 0.0)), power_of_two(60));
}

TEST(RealTables, Exp2UndoesLog2) {
  Random random(2);
  for (int i = 0; i < 10000; ++i) {
    const double x = power_of_two(static_cast<int>(random.below(100)) - 50) * (1 + random.unit());
    EXPECT_NEAR(fast_exp2(fast_log2(x)) / x, 1, 5e-6) << x;
  }
}

double logistic(double t) {
  return 16777216.0 / (1 + std::exp(-t));
}

TEST(LogisticTableTest, RightWhereItIsKnown) {
  EXPECT_EQ(LogisticTable::at(0), 1u << 23);
  for (double t : {1.0, -1.0, 5.0, -5.0}) EXPECT_NEAR(LogisticTable::at(t), logistic(t), 2) << t;
  // Chords between 1/32 apart: at most (1/32)^2 / 8 of the greatest second derivative away, and rounding.
  for (double t = -16; t <= 16; t += 0.003) EXPECT_NEAR(LogisticTable::at(t), logistic(t), 210) << t;
}

TEST(LogisticTableTest, NeverFallsOverAFineSweep) {
  std::uint32_t before = LogisticTable::at(-17);
  std::uint32_t rises = 0;
  for (double t = -17; t <= 17; t += 0x1p-15) {
    const std::uint32_t now = LogisticTable::at(t);
    ASSERT_GE(now, before) << t;
    rises += now > before ? 1 : 0;
    before = now;
  }
  EXPECT_GT(rises, 300000u);
}

TEST(LogisticTableTest, EveryDoubleHasAnAnswer) {
  const std::uint32_t least = LogisticTable::at(-16);
  EXPECT_LE(least, 2u);
  for (double t : {-16.5, -1e9, -1e300, -kInfinity, kNan}) EXPECT_EQ(LogisticTable::at(t), least) << t;
  const std::uint32_t most = LogisticTable::at(16);
  EXPECT_GE(most, (1u << 24) - 3);
  EXPECT_LE(most, 1u << 24);
  for (double t : {16.5, 1e9, 1e300, kInfinity}) EXPECT_EQ(LogisticTable::at(t), most) << t;
  for (double t : {-0.0, std::numeric_limits<double>::denorm_min(), -std::numeric_limits<double>::denorm_min()}) {
    EXPECT_NEAR(LogisticTable::at(t), 1u << 23, 4) << t;
  }
}

TEST(LogisticTableTest, IsSymmetric) {
  for (double t = 0; t < 15.9; t += 0x1.8p-12) {
    EXPECT_NEAR(static_cast<double>(LogisticTable::at(t)) + LogisticTable::at(-t), 1u << 24, 1) << t;
  }
}

// Whatever steers decoding may not depend on the build: gcc 12 and clang 14 at -O0 and -O3 gave these.
TEST(RealTables, TheBitsAreTheSameEverywhere) {
  Random random(3);
  Hash64 logs;
  Hash64 powers;
  Hash64 masses;
  for (int i = 0; i < 100000; ++i) {
    const double x = power_of_two(static_cast<int>(random.below(120)) - 60) * (1 + random.unit());
    logs.add(std::bit_cast<std::uint64_t>(fast_log2(x)));
    powers.add(std::bit_cast<std::uint64_t>(fast_exp2((random.unit() - 0.5) * 124)));
    masses.add(LogisticTable::at((random.unit() - 0.5) * 33));
  }
  EXPECT_EQ(logs.value(), 18097299334839397113u);
  EXPECT_EQ(powers.value(), 12427202784666091525u);
  EXPECT_EQ(masses.value(), 9755316019791731140u);
}

}  // namespace
}  // namespace pmcd::codec::testing
