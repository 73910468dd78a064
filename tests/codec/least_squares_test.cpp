// SPDX-License-Identifier: MIT
// Least squares that forgets: finds weights, keeps its prior where nothing speaks against it, follows a change, and
// survives systems that have no solution.
#include "codec/geometry/least_squares.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

float real(double value) {
  return static_cast<float>(value);
}

template <std::size_t Terms, std::size_t Targets>
void observe(LeastSquares<Terms, Targets>& fit, const std::array<float, Terms>& features,
             const std::array<float, Targets>& targets, float importance = 1) {
  typename LeastSquares<Terms, Targets>::Equation equation{};
  std::copy(features.begin(), features.end(), equation.value.begin());
  std::copy(targets.begin(), targets.end(), equation.value.begin() + Terms);
  fit.observe(importance, {&equation, 1});
}

template <std::size_t Terms>
float value_of(const std::array<float, Terms>& weights, const std::array<float, Terms>& features) {
  float sum = 0;
  for (std::size_t i = 0; i < Terms; ++i) sum += weights[i] * features[i];
  return sum;
}

template <std::size_t Terms>
std::array<float, Terms> random_features(Random& random) {
  std::array<float, Terms> features{};
  for (float& f : features) f = real(random.unit() * 4 - 2);
  return features;
}

// A float is good to 6e-8, what was summed up and solved to some ten times as much.
constexpr float kNear = 2e-6f;

using Two = LeastSquares<4, 2>;

TEST(LeastSquaresTest, FindsTheWeightsOfNoiselessData) {
  const Two::Weights first{0.5f, -2, 3, 0.25f};
  const Two::Weights second{-1, 0, 7, 1e-3f};
  Two fit({0.999f, 1e-6f, 16}, {Two::Weights{}, Two::Weights{}});
  Random random(1);
  for (int i = 0; i < 320; ++i) {
    const auto features = random_features<4>(random);
    observe<4, 2>(fit, features, {value_of(first, features), value_of(second, features)}, real(0.1 + random.unit()));
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(fit.weight(0)[i], first[i], 4 * kNear);
    EXPECT_NEAR(fit.weight(1)[i], second[i], 4 * kNear);
  }
}

TEST(LeastSquaresTest, SolvesOnlyEverySoOften) {
  Two fit({0.999f, 1e-3f, 16}, {Two::Weights{}, Two::Weights{}});
  Random random(2);
  for (int i = 0; i < 15; ++i) observe<4, 2>(fit, random_features<4>(random), {1, 1});
  EXPECT_EQ(fit.weight(0), Two::Weights{});
  observe<4, 2>(fit, random_features<4>(random), {1, 1});
  EXPECT_NE(fit.weight(0), Two::Weights{});
}

TEST(LeastSquaresTest, PriorHoldsWithoutData) {
  const Two::Weights first{0.5f, -2, 3, 0.25f};
  const Two::Weights second{1, 2, 3, 4};
  Two fit({0.99f, 4, 8}, {first, second});
  EXPECT_EQ(fit.weight(0), first);
  EXPECT_EQ(fit.weight(1), second);
  for (int i = 0; i < 100; ++i) observe<4, 2>(fit, {0, 0, 0, 0}, {5, 5});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(fit.weight(0)[i], first[i], kNear);
    EXPECT_NEAR(fit.weight(1)[i], second[i], kNear);
  }
}

TEST(LeastSquaresTest, PriorHoldsWhereNothingSpeaksAgainstIt) {
  Two fit({0.99f, 0.1f, 8}, {Two::Weights{1, 1, 1, 1}, Two::Weights{}});
  for (int i = 0; i < 800; ++i) observe<4, 2>(fit, {1, 0, 0, i % 2 == 0 ? 1.0f : -1.0f}, {3, 0});
  EXPECT_NEAR(fit.weight(0)[0], 3, 0.01);
  EXPECT_NEAR(fit.weight(0)[1], 1, kNear);
  EXPECT_NEAR(fit.weight(0)[2], 1, kNear);
  EXPECT_NEAR(fit.weight(0)[3], 0, 0.01);
}

TEST(LeastSquaresTest, RidgeWeighsThePriorAgainstData) {
  // One feature of one, target 1, prior 0: n / (n + ridge) for next to no decay.
  LeastSquares<1, 1> fit({1 - 0x1p-24f, 30, 10}, {std::array<float, 1>{0}});
  for (int i = 0; i < 10; ++i) observe<1, 1>(fit, {1}, {1});
  EXPECT_NEAR(fit.weight(0)[0], 10.0 / 40, kNear);
  for (int i = 0; i < 50; ++i) observe<1, 1>(fit, {1}, {1});
  EXPECT_NEAR(fit.weight(0)[0], 60.0 / 90, kNear);
}

TEST(LeastSquaresTest, Forgets) {
  LeastSquares<1, 1> fit({0.99f, 1e-9f, 10}, {std::array<float, 1>{0}});
  for (int i = 0; i < 2000; ++i) observe<1, 1>(fit, {1}, {5});
  EXPECT_NEAR(fit.weight(0)[0], 5, 2 * kNear);
  // After n new ones the old ones count for 0.99^n.
  for (int i = 0; i < 100; ++i) observe<1, 1>(fit, {1}, {-1});
  EXPECT_NEAR(fit.weight(0)[0], -1 + 6 * std::pow(0.99, 100), 0.02);
  for (int i = 0; i < 1900; ++i) observe<1, 1>(fit, {1}, {-1});
  EXPECT_NEAR(fit.weight(0)[0], -1, kNear);
}

TEST(LeastSquaresTest, SingularSystemsKeepFiniteWeights) {
  Random random(3);
  for (float ridge : {0.0f, 1e-12f, 1.0f}) {
    for (float size : {0.0f, 1e-30f, 1e-9f, 1.0f, 1e9f, 1e15f, 1e25f}) {
      Two fit({0.998f, ridge, 16}, {Two::Weights{0.3f, 0.3f, 0, 0}, Two::Weights{}});
      for (int i = 0; i < 400; ++i) {
        const float a = size * real(random.unit() - 0.5);
        observe<4, 2>(fit, {a, a, 2 * a, -a}, {a, 1});
        for (std::size_t target = 0; target < 2; ++target) {
          for (float weight : fit.weight(target)) ASSERT_TRUE(std::isfinite(weight)) << ridge << " " << size;
        }
      }
    }
  }
}

TEST(LeastSquaresTest, AManyTimesLongerRunStaysFiniteAndRight) {
  const Two::Weights wanted{2, -1, 0.5f, 4};
  Two fit({0.9f, 1e-6f, 64}, {Two::Weights{}, Two::Weights{}});
  Random random(4);
  for (int i = 0; i < 64 * 1000; ++i) {
    const auto features = random_features<4>(random);
    observe<4, 2>(fit, features, {value_of(wanted, features), 0});
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(fit.weight(0)[i], wanted[i], 2 * kNear);
}

// Three equations at once, one for each axis, are three observations of the same age.
TEST(LeastSquaresTest, EquationsOfAVectorCountTogether) {
  using One = LeastSquares<2, 1>;
  One fit({0.5f, 1e-6f, 2}, {One::Weights{}});
  auto equations = [](std::array<float, 3> targets) {
    std::array<One::Equation, 3> all{};
    for (std::size_t axis = 0; axis < 3; ++axis) all[axis].value = {1, 0, targets[axis], 0};
    return all;
  };
  fit.observe(1, equations({9, 9, 9}));
  EXPECT_EQ(fit.weight(0), One::Weights{});
  fit.observe(1, equations({1, 2, 6}));
  EXPECT_NEAR(fit.weight(0)[0], (0.5 * 27 + 9) / 4.5, kNear);
  EXPECT_EQ(fit.weight(0)[1], 0);
}

}  // namespace
}  // namespace pmcd::codec::testing
