// SPDX-License-Identifier: MIT
// The tables behind the models: near enough to the functions that they stand for, never falling, defined for every
// number, and the same bits from every compiler.
#include "codec/entropy/real_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>

#include "codec/packet/hash.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

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
  for (int whole = -60; whole <= 60; ++whole) EXPECT_EQ(fast_exp2(static_cast<double>(whole)), power_of_two(whole));
  for (double x : {-60.5, -1e300, -double{kInfinity}, double{kNan}}) EXPECT_EQ(fast_exp2(x), power_of_two(-60)) << x;
  for (double x : {60.5, 1e300, double{kInfinity}}) EXPECT_EQ(fast_exp2(x), power_of_two(60)) << x;
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

// The answer of one lane; which, goes round.
std::int32_t logistic_at(float t) {
  static int lane = 0;
  lane = lane == 3 ? 0 : lane + 1;
  Four all{-3.0f, 0.25f, 7.0f, -12.5f};
  const auto others = LogisticTable::at(all);
  all[lane] = t;
  const auto answers = LogisticTable::at(all);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(i == lane || answers[i] == others[i]) << "lane " << i << ", " << t;
  return answers[lane];
}

TEST(LogisticTableTest, RightWhereItIsKnown) {
  EXPECT_EQ(logistic_at(0), 1 << 23);
  for (float t : {1.0f, -1.0f, 5.0f, -5.0f}) EXPECT_NEAR(logistic_at(t), logistic(static_cast<double>(t)), 2) << t;
  // Chords between 1/32 apart: at most (1/32)^2 / 8 of the greatest second derivative away, and t is cut
  // to 2^-15, where the curve rises by 128.
  for (float t = -16; t <= 16; t += 0.003f) {
    EXPECT_NEAR(logistic_at(t), logistic(static_cast<double>(t)), 210 + 128) << t;
  }
}

TEST(LogisticTableTest, NeverFallsOverAFineSweep) {
  std::int32_t before = LogisticTable::at(Four{} - 17.0f)[0];
  std::uint32_t rises = 0;
  for (float t = -17; t <= 17; t += 0x1p-15f) {
    const std::int32_t now = LogisticTable::at(Four{} + t)[0];
    ASSERT_GE(now, before) << t;
    rises += now > before ? 1 : 0;
    before = now;
  }
  EXPECT_GT(rises, 300000u);
}

TEST(LogisticTableTest, EveryFloatHasAnAnswer) {
  const std::int32_t least = logistic_at(-16);
  EXPECT_GE(least, 0);
  EXPECT_LE(least, 2);
  for (float t : {-16.5f, -1e9f, -3e38f, -kInfinity, kNan, -kNan}) EXPECT_EQ(logistic_at(t), least) << t;
  const std::int32_t most = logistic_at(16);
  EXPECT_GE(most, (1 << 24) - 3);
  EXPECT_LE(most, 1 << 24);
  for (float t : {16.5f, 1e9f, 3e38f, kInfinity}) EXPECT_EQ(logistic_at(t), most) << t;
  constexpr float kTiny = std::numeric_limits<float>::denorm_min();
  for (float t : {-0.0f, kTiny, -kTiny}) EXPECT_NEAR(logistic_at(t), 1 << 23, 4) << t;
}

TEST(LogisticTableTest, IsSymmetric) {
  for (float t = 0; t < 15.9f; t += 0x1.8p-12f) {
    EXPECT_NEAR(logistic_at(t) + logistic_at(-t), 1 << 24, 1) << t;
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
    const auto t = static_cast<float>((random.unit() - 0.5) * 33);
    const auto four = LogisticTable::at(Four{t, -t, t + 0.01f, 2 * t});
    for (int lane = 0; lane < 4; ++lane) masses.add(static_cast<std::uint64_t>(four[lane]));
  }
  EXPECT_EQ(logs.value(), 18097299334839397113u);
  EXPECT_EQ(powers.value(), 12427202784666091525u);
  EXPECT_EQ(masses.value(), 12144175687296840951u);
}

}  // namespace
}  // namespace pmcd::codec::testing
