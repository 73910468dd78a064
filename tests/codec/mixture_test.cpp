// SPDX-License-Identifier: MIT
// Mixture: a distribution function that never falls, and weights that follow what comes.
#include "codec/geometry/mixture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

float power_of_two(int exponent) {
  return std::ldexp(1.0f, exponent);
}

float rounded(double value) {
  return static_cast<float>(value);
}

double gaussian(Random& random) {
  return std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(6.283185307179586 * random.unit());
}

TEST(MixtureTest, NeverFallsAndEndsAtTheWhole) {
  Random random(1);
  for (int run = 0; run < 60; ++run) {
    Mixture::Weights weights{0.3f, 0.5f, 0.2f};
    std::array<Mixture::SpikeWeights, Mixture::kSpikes> spike_weights;
    for (Mixture::SpikeWeights& spike : spike_weights) spike = {rounded(random.unit()), rounded(random.unit())};
    const double mean = random.unit() * 1000;
    const float spread = power_of_two(static_cast<int>(random.below(14)) - 4);
    Mixture mixture(mean, spread, weights);
    const std::size_t spikes = random.below(Mixture::kSpikes + 1);
    for (std::size_t k = 0; k < spikes; ++k) {
      mixture.add_spike(static_cast<std::int32_t>(random.below(1000)), spike_weights[k]);
    }
    const auto first = static_cast<std::int32_t>(random.below(1000));
    mixture.begin_at(first);
    std::uint32_t before = 0;
    for (int cell = -200; cell < 1300; ++cell) {
      const std::uint32_t now = mixture.below(cell - first);
      ASSERT_GE(now, before) << cell;
      ASSERT_LE(now, 1u << 24);
      before = now;
    }
    EXPECT_LE(mixture.below(-(1 << 25)), 16u);
    EXPECT_NEAR(mixture.below(1 << 25), 1u << 24, 400);
    if (spikes == 0) {
      // Beyond its reach it expects nothing.
      const auto reach = static_cast<std::int32_t>(mixture.reach()) + 1;
      EXPECT_LE(mixture.below(static_cast<std::int32_t>(mean) - reach - first), 300u);
      EXPECT_GE(mixture.below(static_cast<std::int32_t>(mean) + 1 + reach - first), (1u << 24) - 700);
    }
  }
}

TEST(MixtureTest, HalfLiesBelowTheMean) {
  for (float spread : {0.05f, 1.0f, 37.0f, 60000.0f}) {
    Mixture::Weights weights = Mixture::kEven;
    Mixture mixture(4999.5, spread, weights);  // between two cells
    mixture.begin_at(3000);
    EXPECT_NEAR(mixture.below(2000), 1u << 23, 600);
  }
}

TEST(MixtureTest, SpikesHoldTheirShare) {
  Mixture::Weights weights{0.3f, 0.5f, 0.2f};
  Mixture::SpikeWeights first{0.25f, 0};
  Mixture::SpikeWeights second{0.5f, 0};
  Mixture::SpikeWeights third{0, 0};
  Mixture mixture(100, 1, weights);
  mixture.add_spike(40, first);
  mixture.add_spike(900, second);
  mixture.add_spike(500, third);
  mixture.begin_at(10);
  auto between = [&](std::int32_t from, std::int32_t to) { return mixture.below(to - 10) - mixture.below(from - 10); };
  // A part that learnt it is worth nothing keeps 1 / 2500 of what is left.
  constexpr double kAll = 1u << 24;
  EXPECT_NEAR(between(40, 41), kAll * 0.25, 6000);
  // The second of what the first leaves.
  EXPECT_NEAR(between(900, 901), kAll * 0.375, 8000);
  EXPECT_NEAR(between(41, 900), kAll * 0.375, 18000);
  EXPECT_GT(between(500, 501), 1000u);
  EXPECT_LT(between(480, 521), 8000u);
}

TEST(MixtureTest, SpikesDrawWhatLiesARoundingAway) {
  Mixture::Weights weights{0.3f, 0.5f, 0.2f};
  Mixture::SpikeWeights spike{0.25f, 0.5f};
  Mixture mixture(100, 1, weights);
  mixture.add_spike(900, spike);
  mixture.begin_at(0);
  auto share = [&](std::int32_t cell) { return (mixture.below(cell + 1) - mixture.below(cell)) / 16777216.0; };
  // Half of the three quarters that the exact part leaves, about the value alike on either side.
  EXPECT_NEAR(share(899) + share(900) + share(901), 0.25 + 0.375 * 0.93, 0.002);
  EXPECT_NEAR(share(899), share(901), 1e-4);
  EXPECT_GT(share(899), 0.07);
  EXPECT_GT(share(900) - 0.25, 2 * share(899));
  EXPECT_LT(share(897), 0.004);
  EXPECT_NEAR((mixture.below(906) - mixture.below(895)) / 16777216.0, 0.625, 0.001);
}

TEST(MixtureTest, QuantileIsAboutWhereTheMassIsReached) {
  for (float spread : {30.0f, 5000.0f}) {
    Mixture::Weights weights{0, 1, 0};
    Mixture mixture(50000, spread, weights);
    mixture.begin_at(47);
    for (double share : {0.01, 0.2, 0.5, 0.8, 0.99}) {
      const auto mass = static_cast<std::uint64_t>(share * 16777216);
      // Rounded to a cell, which may hold this much.
      const double cell = 16777216 / (4 * 0.7 * static_cast<double>(spread));
      EXPECT_NEAR(mixture.below(static_cast<std::int32_t>(mixture.quantile(mass) + 0.5f)), static_cast<double>(mass),
                  2000 + cell / 2)
          << spread << " " << share;
    }
    EXPECT_TRUE(std::isfinite(mixture.quantile(0)));
    EXPECT_TRUE(std::isfinite(mixture.quantile((1u << 24) - 1)));
    EXPECT_TRUE(std::isfinite(mixture.quantile(~std::uint64_t{0} >> 8)));
  }
}

// What came is this cell, which is counted from another.
void learn(Mixture& mixture, std::int32_t cell) {
  mixture.begin_at(7);
  mixture.learn(cell - 7, cell - 7 + 1);
}

void expect_shares(const Mixture::Weights& weights) {
  float sum = 0;
  for (int k = 0; k < static_cast<int>(Mixture::kWidths); ++k) {
    ASSERT_TRUE(weights[k] >= 0 && weights[k] <= 1) << weights[k];
    sum += weights[k];
  }
  ASSERT_NEAR(sum, 1, 5e-6);
  ASSERT_EQ(weights[Mixture::kWidths], 0);
}

void expect_shares(const Mixture::SpikeWeights& weights) {
  ASSERT_TRUE(weights.exact >= 0 && weights.exact < 1) << weights.exact;
  ASSERT_TRUE(weights.near >= 0 && weights.near < 1) << weights.near;
  ASSERT_LT(weights.exact + weights.near, 1 + 5e-6f);
}

TEST(MixtureTest, WeightsStayADistributionAndFollowWhatComes) {
  Mixture::Weights narrow{0.3f, 0.5f, 0.2f};
  Mixture::Weights wide{0.3f, 0.5f, 0.2f};
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const double near = std::floor(1000 + 8 * gaussian(random));
    const double far = std::floor(1000 + 150 * gaussian(random));
    Mixture expects_near(1000, 40, narrow);
    Mixture expects_far(1000, 40, wide);
    learn(expects_near, static_cast<std::int32_t>(near));
    learn(expects_far, static_cast<std::int32_t>(far));
    expect_shares(narrow);
    expect_shares(wide);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(narrow[0], 0.9f);
  EXPECT_GT(wide[2], 0.9f);
}

TEST(MixtureTest, PartsOfASpikeFollowWhatComes) {
  Random random(4);
  Mixture::Weights weights{0.3f, 0.5f, 0.2f};
  Mixture::SpikeWeights hit;
  Mixture::SpikeWeights missed;
  Mixture::SpikeWeights nearly;
  for (int i = 0; i < 600; ++i) {
    const std::int32_t value = static_cast<std::int32_t>(random.below(1000));
    auto follow = [&](Mixture::SpikeWeights& spike, std::int32_t came) {
      Mixture mixture(value + 60 * gaussian(random), 60, weights);
      mixture.add_spike(value, spike);
      learn(mixture, came);
      expect_shares(spike);
    };
    follow(hit, value);
    follow(missed, value + (random.one_in(2) ? 40 : -40));
    follow(nearly, value + (random.one_in(2) ? 1 : -1));
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(hit.exact, 0.95f);
  EXPECT_LT(hit.near, 0.02f);
  EXPECT_LT(missed.exact + missed.near, 1e-3f);
  EXPECT_LT(nearly.exact, 1e-3f);
  EXPECT_GT(nearly.near, 0.8f);
}

// What was right ten thousand times leaves next to nothing for anything else; something it must leave.
TEST(MixtureTest, CertaintySurvivesASurprise) {
  Mixture::Weights weights{0.3f, 0.5f, 0.2f};
  Mixture::SpikeWeights certain;
  Mixture::SpikeWeights other;
  auto follow = [&](std::int32_t came) {
    Mixture mixture(100, 30, weights);
    mixture.add_spike(100, certain);
    mixture.add_spike(100, other);
    learn(mixture, came);
    expect_shares(weights);
    expect_shares(certain);
    expect_shares(other);
  };
  for (int i = 0; i < 10000; ++i) follow(100);
  EXPECT_GT(certain.exact, 0.99f);
  const float before = certain.exact;
  for (int i = 0; i < 100; ++i) follow(1 << 25);
  EXPECT_LT(certain.exact, 0.1f * before);
}

TEST(MixtureTest, AnythingMayCome) {
  Mixture::Weights weights{0.3f, 0.5f, 0.2f};
  std::array<Mixture::SpikeWeights, Mixture::kSpikes> spikes;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    Mixture mixture(random.unit() * 1e6, power_of_two(static_cast<int>(random.below(30)) - 5), weights);
    const std::size_t count = random.below(Mixture::kSpikes + 1);
    const auto value = static_cast<std::int32_t>(random.below(1000000));
    for (std::size_t k = 0; k < count; ++k) {
      mixture.add_spike(random.one_in(2) ? value : static_cast<std::int32_t>(random.below(1000000)), spikes[k]);
    }
    const auto other = static_cast<std::int32_t>(random.below(1000000));
    learn(mixture, random.one_in(3) ? 1 << 25 : (random.one_in(2) ? value : other));
    expect_shares(weights);
    for (const Mixture::SpikeWeights& spike : spikes) expect_shares(spike);
    ASSERT_FALSE(HasFatalFailure()) << i;
  }
}

TEST(MixtureTest, SpikesThatAreNearlyCertainOrFarAwayLeaveADistribution) {
  Random random(8);
  for (int run = 0; run < 200; ++run) {
    Mixture::Weights weights = Mixture::kEven;
    std::array<Mixture::SpikeWeights, Mixture::kSpikes> spikes;
    Mixture mixture(random.unit() * 2000, power_of_two(static_cast<int>(random.below(20)) - 4), weights);
    constexpr std::array<std::int32_t, 5> kFar = {-(1 << 25), 1 << 24, 1 << 26, 0, 999};
    for (Mixture::SpikeWeights& spike : spikes) {
      spike.exact = random.one_in(2) ? 1 - 1.2e-6f : rounded(random.unit());
      spike.near = rounded((1 - static_cast<double>(spike.exact)) * random.unit());
      mixture.add_spike(random.one_in(2) ? kFar[random.below(5)] : static_cast<std::int32_t>(random.below(1000)),
                        spike);
    }
    const auto first = static_cast<std::int32_t>(random.below(1000));
    mixture.begin_at(first);
    std::uint32_t before = 0;
    for (std::int32_t n = -first; n < 1200; ++n) {
      const std::uint32_t now = mixture.below(n);
      ASSERT_GE(now, before);
      ASSERT_LE(now, 1u << 24);
      before = now;
    }
    mixture.learn(300, 301);
    expect_shares(weights);
    for (const Mixture::SpikeWeights& spike : spikes) expect_shares(spike);
    ASSERT_FALSE(HasFatalFailure()) << run;
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
