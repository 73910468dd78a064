// SPDX-License-Identifier: MIT
// CoordinateModel: coordinates come back wherever they were expected, at the price that the distribution says; garbage
// stays within the lattice or is refused.
#include "codec/geometry/coordinate_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/codec/coding.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

constexpr float kMostSpread = 16777216.0f;

double power_of_two(int exponent) {
  return std::ldexp(1.0, exponent);
}

double gaussian(Random& random) {
  return std::sqrt(-2 * std::log(1 - random.unit())) * std::cos(6.283185307179586 * random.unit());
}

float any_spread(Random& random) {
  const double spread = power_of_two(static_cast<int>(random.below(30)) - 5) * (1 + random.unit());
  return std::min(static_cast<float>(spread), kMostSpread);
}

struct Coordinate {
  std::int32_t value;
  double mean;
  float spread;
  std::size_t order;
  std::int32_t most;
  std::vector<RepeatedValue> repeated;
};

std::int32_t code(auto& source, CoordinateModel& model, const Coordinate& c) {
  Mixture mixture = model.mixture(c.mean, c.spread, c.order, c.repeated);
  return model.code(source, c.value, mixture, c.most);
}

std::vector<Coordinate> random_coordinates(std::uint64_t seed, std::size_t length, bool spikes) {
  Random random(seed);
  std::vector<Coordinate> all;
  for (std::size_t i = 0; i < length; ++i) {
    Coordinate c{};
    c.most = (1 << (1 + random.below(24))) - 1;
    const auto cells = static_cast<std::uint64_t>(c.most) + 1;
    c.mean = random.unit() * c.most;
    if (random.one_in(8)) c.mean = random.one_in(2) ? 0 : c.most;
    if (random.one_in(8)) c.mean = (random.unit() - 0.5) * power_of_two(31);  // as far as the contract lets
    c.spread = any_spread(random);
    if (random.one_in(10)) c.spread = random.one_in(2) ? 1e-3f : kMostSpread;
    c.order = random.below(3);
    const double near = c.mean + gaussian(random) * static_cast<double>(c.spread);
    c.value = static_cast<std::int32_t>(std::clamp<double>(near, 0, c.most));
    if (random.one_in(3)) c.value = static_cast<std::int32_t>(random.below(cells));
    if (random.one_in(6)) c.value = random.one_in(2) ? 0 : c.most;
    const std::size_t kinds = spikes ? random.below(Mixture::kSpikes + 1) : 0;
    for (std::size_t k = 0; k < kinds; ++k) {
      const auto any = static_cast<std::int32_t>(random.below(2 * cells)) - c.most / 2;  // also outside the lattice
      c.repeated.push_back({random.one_in(3) ? c.value : any, k, random.below(kSpikeContexts)});
    }
    all.push_back(std::move(c));
  }
  return all;
}

TEST(CoordinateModelTest, EveryValueComesBack) {
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const std::vector<Coordinate> all = random_coordinates(seed, 1500, seed % 2 == 1);
    ModelWriter writer;
    CoordinateModel out;
    for (const Coordinate& c : all) ASSERT_EQ(code(writer, out, c), c.value);
    ModelReader reader(writer.finish());
    CoordinateModel in;
    for (std::size_t i = 0; i < all.size(); ++i) {
      Coordinate unknown = all[i];
      unknown.value = 0;
      ASSERT_EQ(code(reader, in, unknown), all[i].value) << "seed " << seed << ", value " << i;
    }
    EXPECT_TRUE(reader.at_end());
    EXPECT_FALSE(reader.overrun());
  }
}

TEST(CoordinateModelTest, ValuesOutsideTheBinsComeBack) {
  constexpr std::int32_t kMost = (1 << 24) - 1;
  const std::vector<Coordinate> all = {
      {kMost, 0, 0.05f, 0, kMost, {}},       {0, kMost, 0.05f, 0, kMost, {}}, {0, kMost / 2, 1, 1, kMost, {}},
      {kMost, kMost / 2, 1, 1, kMost, {}},   {1, 4, 0.04f, 2, 15, {}},        {15, 4, 0.04f, 2, 15, {}},
      {kMost, 0, kMostSpread, 2, kMost, {}}, {0, -1e9, 0.5f, 0, 1, {}},       {1, 1e9, 0.5f, 0, 1, {}},
  };
  ModelWriter writer;
  CoordinateModel out;
  for (const Coordinate& c : all) ASSERT_EQ(code(writer, out, c), c.value);
  // An escape costs about 17 bits and the distance twice: no disaster, but no gift.
  EXPECT_GT(writer.bits(), 5 * 17.0);
  EXPECT_LT(writer.bits(), 6 * 17.0 + 6 * 60.0);
  ModelReader reader(writer.finish());
  CoordinateModel in;
  for (const Coordinate& c : all) {
    Coordinate unknown = c;
    unknown.value = 0;
    ASSERT_EQ(code(reader, in, unknown), c.value);
  }
  EXPECT_TRUE(reader.at_end());
}

TEST(CoordinateModelTest, EveryCellOfASmallLatticeUnderEveryExpectation) {
  for (std::int32_t most : {1, 3, 15}) {
    for (double mean : {-5.0, 0.0, 0.5, 1.0, 7.3, 15.0, 40.0}) {
      for (float spread : {1e-3f, 0.3f, 1.0f, 8.0f, 1e4f, kMostSpread}) {
        ModelWriter writer;
        CoordinateModel out;
        for (std::int32_t value = 0; value <= most; ++value) code(writer, out, {value, mean, spread, 0, most, {}});
        ModelReader reader(writer.finish());
        CoordinateModel in;
        for (std::int32_t value = 0; value <= most; ++value) {
          ASSERT_EQ(code(reader, in, {0, mean, spread, 0, most, {}}), value) << most << " " << mean << " " << spread;
        }
      }
    }
  }
}

TEST(CoordinateModelTest, GarbageStaysWithinTheLatticeOrIsNegative) {
  Random random(8);
  int refused = 0;
  int accepted = 0;
  for (int run = 0; run < 300; ++run) {
    std::vector<std::byte> bytes(300);
    for (std::byte& b : bytes) b = random.one_in(3) ? std::byte{0xFF} : static_cast<std::byte>(random.below(256));
    ModelReader reader(bytes);
    CoordinateModel model;
    for (Coordinate& c : random_coordinates(static_cast<std::uint64_t>(run), 400, run % 2 == 0)) {
      c.value = 0;
      const std::int32_t value = code(reader, model, c);
      ASSERT_LE(value, c.most);
      (value < 0 ? refused : accepted) += 1;
      if (reader.overrun()) break;
    }
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(accepted, 10000);
}

TEST(CoordinateModelTest, GaussianSamplesCostTheirEntropy) {
  for (double spread : {0.5, 1.0, 3.0, 20.0, 300.0, 40000.0}) {
    Random random(4);
    ModelWriter writer;
    CoordinateModel model;
    constexpr std::int32_t kMost = (1 << 24) - 1;
    double entropy = 0;
    double before = 0;
    for (int i = 0; i < 12000; ++i) {
      if (i == 2000) before = writer.bits();
      const double mean = 3000000 + random.unit() * 1000000;
      const double value = std::floor(mean + gaussian(random) * spread + 0.5);
      if (i >= 2000) {
        auto below = [&](double x) { return 0.5 * std::erfc((mean - x) / (spread * std::sqrt(2.0))); };
        entropy -= std::log2(std::max(below(value + 0.5) - below(value - 0.5), 1e-12));
      }
      const auto cell = static_cast<std::int32_t>(value);
      ASSERT_EQ(code(writer, model, {cell, mean, static_cast<float>(spread), 1, kMost, {}}), cell);
    }
    const double over = (writer.bits() - before - entropy) / 10000;
    EXPECT_LT(over, 0.1) << spread;
    EXPECT_GT(over, -0.01) << spread;
  }
}

TEST(CoordinateModelTest, ARepeatedValueBecomesNextToFree) {
  for (std::size_t kind = 0; kind < Mixture::kSpikes; ++kind) {
    ModelWriter writer;
    CoordinateModel model;
    Random random(5);
    auto repeat = [&](std::int32_t value) {
      std::vector<RepeatedValue> repeated;
      for (std::size_t other = 0; other < kind; ++other) repeated.push_back({0, other, 5});
      repeated.push_back({value, kind, 20});
      const double before = writer.bits();
      EXPECT_EQ(code(writer, model, {value, value + 60 * random.unit(), 40, 0, 4095, repeated}), value);
      return writer.bits() - before;
    };
    const double first = repeat(2000);
    EXPECT_GT(first, 3);
    for (int i = 0; i < 200; ++i) repeat(500 + 10 * i);
    for (int i = 0; i < 50; ++i) EXPECT_LT(repeat(510 + 20 * i), 0.1);
    // Where it is not met it is unlearnt; and other contexts learnt nothing.
    const double before = writer.bits();
    code(writer, model, {2000, 2010, 40, 0, 4095, {{2000, 0, 21}, {2000, 1, 22}, {2000, 2, 23}}});
    EXPECT_GT(writer.bits() - before, 2);
  }
}

TEST(CoordinateModelTest, ASpikeThatNeverHitsCostsNextToNothing) {
  auto cost = [](bool with_spike) {
    Random random(6);
    ModelWriter writer;
    CoordinateModel model;
    for (int i = 0; i < 3000; ++i) {
      const auto value = static_cast<std::int32_t>(std::clamp(2000 + gaussian(random) * 10, 0.0, 4095.0));
      std::vector<RepeatedValue> repeated;
      if (with_spike) repeated = {{3500, 0, 3}};
      code(writer, model, {value, 2000, 10, 0, 4095, repeated});
    }
    return writer.bits() / 3000;
  };
  EXPECT_LT(cost(true) - cost(false), 0.005);
  EXPECT_GT(cost(true) - cost(false), 0);
}

struct Digits {
  std::int32_t value;
  double mean;
  float spread;
  std::size_t order;
  unsigned digits;
};

std::int32_t code(auto& source, CoordinateModel& model, const Digits& d, std::int32_t known) {
  Mixture mixture = model.mixture(d.mean, d.spread, d.order, {});
  return model.code_digits(source, d.value, mixture, known, d.digits);
}

std::vector<Digits> random_digits(std::uint64_t seed, std::size_t length) {
  Random random(seed);
  std::vector<Digits> all;
  for (std::size_t i = 0; i < length; ++i) {
    Digits d{};
    d.digits = 1 + random.below(CoordinateModel::kMostDigits);
    d.value = static_cast<std::int32_t>(random.below(std::uint64_t{1} << (d.digits + random.below(17))));
    d.mean = d.value + (random.unit() - 0.5) * power_of_two(static_cast<int>(random.below(26)));
    if (random.one_in(6)) d.mean = (random.unit() - 0.5) * power_of_two(31);
    d.spread = any_spread(random);
    d.order = random.below(3);
    all.push_back(d);
  }
  return all;
}

TEST(CoordinateModelTest, FurtherDigitsComeBack) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::vector<Digits> all = random_digits(seed, 2000);
    ModelWriter writer;
    CoordinateModel out;
    for (const Digits& d : all) ASSERT_EQ(code(writer, out, d, d.value >> d.digits), d.value);
    ModelReader reader(writer.finish());
    CoordinateModel in;
    for (const Digits& d : all) {
      Digits unknown = d;
      unknown.value = 0;
      ASSERT_EQ(code(reader, in, unknown, d.value >> d.digits), d.value);
    }
    EXPECT_TRUE(reader.at_end());
    EXPECT_FALSE(reader.overrun());
  }
}

TEST(CoordinateModelTest, FurtherDigitsOfGarbageStayInTheirCell) {
  Random random(9);
  for (int run = 0; run < 100; ++run) {
    std::vector<std::byte> bytes(100);
    for (std::byte& b : bytes) b = random.one_in(3) ? std::byte{0xFF} : static_cast<std::byte>(random.below(256));
    ModelReader reader(bytes);
    CoordinateModel model;
    for (Digits& d : random_digits(static_cast<std::uint64_t>(run), 200)) {
      const std::int32_t known = d.value >> d.digits;
      d.value = 0;
      ASSERT_EQ(code(reader, model, d, known) >> d.digits, known);
    }
  }
}

TEST(CoordinateModelTest, FurtherDigitsCostWhatIsUnknown) {
  Random random(10);
  for (unsigned digits = 1; digits <= CoordinateModel::kMostDigits; ++digits) {
    auto cost = [&](float spread, double off) {
      ModelWriter writer;
      CoordinateModel model;
      for (int i = 0; i < 2000; ++i) {
        const auto value = static_cast<std::int32_t>(random.below(1u << 20));
        code(writer, model, {value, value + off * (1u << digits) * (random.unit() + 0.5), spread, 0, digits},
             value >> digits);
      }
      return writer.bits() / 2000;
    };
    const double cells = 1u << digits;
    EXPECT_NEAR(cost(1e5f, 3e4 / cells), digits, 0.1) << digits;  // nothing is known of them
    EXPECT_LT(cost(0.02f, 0), 0.2) << digits;                     // all is known
    EXPECT_NEAR(cost(0.02f, 900), digits, 0.1) << digits;         // what is known is far off: as if nothing were
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
