// SPDX-License-Identifier: MIT
// Mixture: a distribution function that never falls, and weights that follow what comes.
#include "codec/geometry/mixture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

double power_of_two(int exponent) {
  return std::ldexp(1.0, exponent);
}

double gaussian(Random& random) {
  return std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(6.283185307179586 * random.unit());
}

TEST(MixtureTest, NeverFallsAndEndsAtTheWhole) {
  Random random(1);
  for (int run = 0; run < 60; ++run) {
    Mixture::Weights weights{0.3, 0.5, 0.2};
    std::array<double, 2> spike_weights{random.unit(), random.unit()};
    const double mean = random.unit() * 1000;
    const double spread = power_of_two(static_cast<int>(random.below(14)) - 4);
    Mixture mixture(mean, spread, weights);
    const std::size_t spikes = random.below(3);
    for (std::size_t k = 0; k < spikes; ++k) {
      mixture.add_spike(static_cast<std::int32_t>(random.below(1000)), spike_weights[k]);
    }
    std::uint32_t before = 0;
    for (int cell = -200; cell < 1300; ++cell) {
      const std::uint32_t now = mixture.below(cell - 0.5);
      ASSERT_GE(now, before) << cell;
      ASSERT_LE(now, 1u << 24);
      before = now;
    }
    EXPECT_LE(mixture.below(-1e12), 16u);
    EXPECT_NEAR(mixture.below(1e12), 1u << 24, 1200);
    if (spikes == 0) {
      EXPECT_NEAR(mixture.below(mean), 1u << 23, 600);
      // Beyond its reach it expects nothing.
      EXPECT_LE(mixture.below(mean - mixture.reach()), 300u);
      EXPECT_GE(mixture.below(mean + mixture.reach()), (1u << 24) - 1200);
    }
  }
}

TEST(MixtureTest, SpikesHoldTheirShare) {
  Mixture::Weights weights{0.3, 0.5, 0.2};
  double first = 0.25;
  double second = 0.5;
  Mixture mixture(100, 1, weights);
  mixture.add_spike(40, first);
  mixture.add_spike(900, second);
  EXPECT_NEAR(mixture.below(40.5) - mixture.below(39.5), (1u << 24) * 0.25, 1000);
  // The second of what the first leaves.
  EXPECT_NEAR(mixture.below(900.5) - mixture.below(899.5), (1u << 24) * 0.375, 1000);
  EXPECT_NEAR(mixture.below(899.5) - mixture.below(40.5), (1u << 24) * 0.375, 1000);
}

TEST(MixtureTest, QuantileIsAboutWhereTheMassIsReached) {
  for (double spread : {0.1, 1.0, 30.0, 5000.0}) {
    Mixture::Weights weights{0, 1, 0};
    const Mixture mixture(50, spread, weights);
    for (double share : {0.01, 0.2, 0.5, 0.8, 0.99}) {
      const auto mass = static_cast<std::uint64_t>(share * 16777216);
      EXPECT_NEAR(mixture.below(mixture.quantile(mass)), static_cast<double>(mass), 2000) << spread << " " << share;
    }
    EXPECT_TRUE(std::isfinite(mixture.quantile(0)));
    EXPECT_TRUE(std::isfinite(mixture.quantile((1u << 24) - 1)));
    EXPECT_TRUE(std::isfinite(mixture.quantile(~std::uint64_t{0} >> 8)));
  }
}

TEST(MixtureTest, WeightsStayADistributionAndFollowWhatComes) {
  Mixture::Weights narrow{0.3, 0.5, 0.2};
  Mixture::Weights wide{0.3, 0.5, 0.2};
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const double near = std::floor(1000 + 8 * gaussian(random));
    const double far = std::floor(1000 + 150 * gaussian(random));
    Mixture(1000, 40, narrow).learn(near - 0.5, near + 0.5);
    Mixture(1000, 40, wide).learn(far - 0.5, far + 0.5);
    ASSERT_NEAR(narrow[0] + narrow[1] + narrow[2], 1, 1e-9);
    ASSERT_NEAR(wide[0] + wide[1] + wide[2], 1, 1e-9);
  }
  EXPECT_GT(narrow[0], 0.9);
  EXPECT_GT(wide[2], 0.9);
}

TEST(MixtureTest, AnythingMayCome) {
  Mixture::Weights weights{0.3, 0.5, 0.2};
  double spike = 0.03;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    Mixture mixture(random.unit() * 1e6, power_of_two(static_cast<int>(random.below(30)) - 5), weights);
    mixture.add_spike(static_cast<std::int32_t>(random.below(1000000)), spike);
    const double cell = random.one_in(3) ? 1e9 : random.unit() * 1e6;
    mixture.learn(cell - 0.5, cell + 0.5);
    for (double weight : weights) ASSERT_TRUE(weight >= 0 && weight <= 1) << i;
    ASSERT_TRUE(spike >= 0 && spike <= 1);
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
