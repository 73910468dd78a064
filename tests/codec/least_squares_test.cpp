// SPDX-License-Identifier: MIT
// Least squares that forgets: finds weights, keeps its prior where nothing speaks against it, follows a change, and
// survives systems that have no solution.
#include "codec/geometry/least_squares.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

template <std::size_t Terms, std::size_t Targets>
void observe(LeastSquares<Terms, Targets>& fit, const std::array<double, Terms>& features,
             const std::array<double, Targets>& targets, double importance = 1) {
  fit.observe(
      importance, [&](std::size_t i, std::size_t j) { return features[i] * features[j]; },
      [&](std::size_t target, std::size_t i) { return features[i] * targets[target]; });
}

template <std::size_t Terms>
double value_of(const std::array<double, Terms>& weights, const std::array<double, Terms>& features) {
  double sum = 0;
  for (std::size_t i = 0; i < Terms; ++i) sum += weights[i] * features[i];
  return sum;
}

template <std::size_t Terms>
std::array<double, Terms> random_features(Random& random) {
  std::array<double, Terms> features{};
  for (double& f : features) f = random.unit() * 4 - 2;
  return features;
}

using Two = LeastSquares<4, 2>;

TEST(LeastSquaresTest, FindsTheWeightsOfNoiselessData) {
  const Two::Weights first{0.5, -2, 3, 0.25};
  const Two::Weights second{-1, 0, 7, 1e-3};
  Two fit({0.999, 1e-6, 16}, {Two::Weights{}, Two::Weights{}});
  Random random(1);
  for (int i = 0; i < 320; ++i) {
    const auto features = random_features<4>(random);
    observe<4, 2>(fit, features, {value_of(first, features), value_of(second, features)}, 0.1 + random.unit());
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(fit.weight(0)[i], first[i], 1e-6);
    EXPECT_NEAR(fit.weight(1)[i], second[i], 1e-6);
  }
}

TEST(LeastSquaresTest, SolvesOnlyEverySoOften) {
  Two fit({0.999, 1e-3, 16}, {Two::Weights{}, Two::Weights{}});
  Random random(2);
  for (int i = 0; i < 15; ++i) observe<4, 2>(fit, random_features<4>(random), {1, 1});
  EXPECT_EQ(fit.weight(0), Two::Weights{});
  observe<4, 2>(fit, random_features<4>(random), {1, 1});
  EXPECT_NE(fit.weight(0), Two::Weights{});
}

TEST(LeastSquaresTest, PriorHoldsWithoutData) {
  const Two::Weights first{0.5, -2, 3, 0.25};
  const Two::Weights second{1, 2, 3, 4};
  Two fit({0.99, 4, 8}, {first, second});
  EXPECT_EQ(fit.weight(0), first);
  EXPECT_EQ(fit.weight(1), second);
  for (int i = 0; i < 100; ++i) observe<4, 2>(fit, {0, 0, 0, 0}, {5, 5});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(fit.weight(0)[i], first[i], 1e-12);
    EXPECT_NEAR(fit.weight(1)[i], second[i], 1e-12);
  }
}

TEST(LeastSquaresTest, PriorHoldsWhereNothingSpeaksAgainstIt) {
  Two fit({0.99, 0.1, 8}, {Two::Weights{1, 1, 1, 1}, Two::Weights{}});
  for (int i = 0; i < 800; ++i) observe<4, 2>(fit, {1, 0, 0, i % 2 == 0 ? 1.0 : -1.0}, {3, 0});
  EXPECT_NEAR(fit.weight(0)[0], 3, 0.01);
  EXPECT_NEAR(fit.weight(0)[1], 1, 1e-12);
  EXPECT_NEAR(fit.weight(0)[2], 1, 1e-12);
  EXPECT_NEAR(fit.weight(0)[3], 0, 0.01);
}

TEST(LeastSquaresTest, RidgeWeighsThePriorAgainstData) {
  // One feature of one, target 1, prior 0: n / (n + ridge) for next to no decay.
  LeastSquares<1, 1> fit({0.999999999, 30, 10}, {std::array<double, 1>{0}});
  for (int i = 0; i < 10; ++i) observe<1, 1>(fit, {1}, {1});
  EXPECT_NEAR(fit.weight(0)[0], 10.0 / 40, 1e-6);
  for (int i = 0; i < 50; ++i) observe<1, 1>(fit, {1}, {1});
  EXPECT_NEAR(fit.weight(0)[0], 60.0 / 90, 1e-6);
}

TEST(LeastSquaresTest, Forgets) {
  LeastSquares<1, 1> fit({0.99, 1e-9, 10}, {std::array<double, 1>{0}});
  for (int i = 0; i < 2000; ++i) observe<1, 1>(fit, {1}, {5});
  EXPECT_NEAR(fit.weight(0)[0], 5, 1e-6);
  // After n new ones the old ones count for 0.99^n.
  for (int i = 0; i < 100; ++i) observe<1, 1>(fit, {1}, {-1});
  EXPECT_NEAR(fit.weight(0)[0], -1 + 6 * std::pow(0.99, 100), 0.02);
  for (int i = 0; i < 1900; ++i) observe<1, 1>(fit, {1}, {-1});
  EXPECT_NEAR(fit.weight(0)[0], -1, 1e-6);
}

TEST(LeastSquaresTest, SingularSystemsKeepFiniteWeights) {
  Random random(3);
  for (double ridge : {0.0, 1e-12, 1.0}) {
    for (double size : {0.0, 1e-200, 1e-9, 1.0, 1e9, 1e150, 1e200}) {
      Two fit({0.998, ridge, 16}, {Two::Weights{0.3, 0.3, 0, 0}, Two::Weights{}});
      for (int i = 0; i < 400; ++i) {
        const double a = size * (random.unit() - 0.5);
        observe<4, 2>(fit, {a, a, 2 * a, -a}, {a, 1});
        for (std::size_t target = 0; target < 2; ++target) {
          for (double weight : fit.weight(target)) ASSERT_TRUE(std::isfinite(weight)) << ridge << " " << size;
        }
      }
    }
  }
}

TEST(LeastSquaresTest, AManyTimesLongerRunStaysFiniteAndRight) {
  const Two::Weights wanted{2, -1, 0.5, 4};
  Two fit({0.9, 1e-6, 64}, {Two::Weights{}, Two::Weights{}});
  Random random(4);
  for (int i = 0; i < 64 * 1000; ++i) {
    const auto features = random_features<4>(random);
    observe<4, 2>(fit, features, {value_of(wanted, features), 0});
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(fit.weight(0)[i], wanted[i], 1e-6);
}

}  // namespace
}  // namespace pmcd::codec::testing
