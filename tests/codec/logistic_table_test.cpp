// SPDX-License-Identifier: MIT
// The table behind the mixtures: near enough to the function that it stands for, never falling, defined for every
// number, and the same bits from every compiler.
#include "codec/entropy/logistic_table.h"

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
    EXPECT_NEAR(logistic_at(t) + logistic_at(-t), 1 << 24, 8) << t;  // rises lack three digits
  }
}

// Whatever steers decoding may not depend on the build: gcc 12 and clang 14 at -O0 and -O3 gave these.
TEST(LogisticTableTest, TheBitsAreTheSameEverywhere) {
  Random random(3);
  Hash64 masses;
  for (int i = 0; i < 100000; ++i) {
    const auto t = static_cast<float>((random.unit() - 0.5) * 33);
    const auto four = LogisticTable::at(Four{t, -t, t + 0.01f, 2 * t});
    for (int lane = 0; lane < 4; ++lane) masses.add(static_cast<std::uint64_t>(four[lane]));
  }
  EXPECT_EQ(masses.value(), 8296417387372906539u);
}

}  // namespace
}  // namespace pmcd::codec::testing
