// SPDX-License-Identifier: MIT
// RangeEncoder::part and RangeDecoder::symbol: numbers under any distribution come back wherever the search for them
// starts, cost what they should, and damaged bytes end in an answer below the count.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/codec/coding.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

// Rises strictly from 0; the last is the total.
using Table = std::vector<std::uint32_t>;

constexpr std::uint32_t kMostTotal = (1u << 26) - 1;

// Of `count` parts: even, random, or nearly all for one of them.
Table random_table(Random& random, std::uint32_t count, std::uint32_t total) {
  Table table = {0};
  if (random.one_in(3)) {  // least parts, but for one
    const std::uint32_t large = random.below(count);
    for (std::uint32_t s = 0; s < count; ++s) table.push_back(table.back() + (s == large ? total - count + 1 : 1));
    return table;
  }
  for (std::uint32_t s = 1; s < count; ++s) table.push_back(1 + random.below(total - 1));
  table.push_back(total);
  std::sort(table.begin(), table.end());
  table.erase(std::unique(table.begin(), table.end()), table.end());
  return table;
}

struct Step {
  Table table;
  std::uint32_t value;
  std::uint32_t guess;
};

std::vector<Step> random_steps(std::uint64_t seed, std::size_t length) {
  Random random(seed);
  std::vector<Step> steps;
  for (std::size_t i = 0; i < length; ++i) {
    const std::uint32_t wanted = 1 + random.below(random.one_in(4) ? 3 : (random.one_in(8) ? 4000 : 60));
    const std::uint32_t total = random.one_in(3) ? kMostTotal : wanted + random.below(kMostTotal - wanted);
    Step step{random_table(random, wanted, std::max(2u, total)), 0, 0};
    const auto count = static_cast<std::uint32_t>(step.table.size() - 1);
    // By probability, or at either end, or any.
    const std::uint32_t mass = random.below(step.table.back());
    step.value = static_cast<std::uint32_t>(std::upper_bound(step.table.begin(), step.table.end(), mass) -
                                            step.table.begin() - 1);
    if (random.one_in(4)) step.value = random.one_in(2) ? 0 : count - 1;
    if (random.one_in(4)) step.value = random.below(count);
    switch (random.below(4)) {
      case 0:
        step.guess = 0;
        break;
      case 1:
        step.guess = count - 1;
        break;
      case 2:
        step.guess = step.value;
        break;
      default:
        step.guess = random.below(count);
    }
    steps.push_back(std::move(step));
  }
  return steps;
}

std::uint32_t code(auto& source, const Step& step) {
  const auto count = static_cast<std::uint32_t>(step.table.size() - 1);
  return source.symbol(
      step.value, count, [&](std::uint64_t /*scaled*/) { return step.guess; },
      [&](std::uint32_t symbol) { return step.table.at(symbol); });
}

TEST(SymbolCoding, RandomDistributionsComeBackFromAnyGuess) {
  for (std::uint64_t seed = 0; seed < 150; ++seed) {
    const std::vector<Step> steps = random_steps(seed, 1 + seed * 3);
    ModelWriter writer;
    for (const Step& step : steps) code(writer, step);
    ModelReader reader(writer.finish());
    for (std::size_t i = 0; i < steps.size(); ++i) {
      ASSERT_EQ(code(reader, steps[i]), steps[i].value) << "seed " << seed << ", step " << i;
    }
    EXPECT_TRUE(reader.at_end()) << "seed " << seed;
    EXPECT_FALSE(reader.overrun()) << "seed " << seed;
  }
}

TEST(SymbolCoding, EveryGuessFindsEverySymbol) {
  Random random(5);
  for (std::uint32_t count : {1u, 2u, 3u, 7u, 33u}) {
    const Table table = random_table(random, count, kMostTotal);
    const auto parts = static_cast<std::uint32_t>(table.size() - 1);
    for (std::uint32_t value = 0; value < parts; ++value) {
      for (std::uint32_t guess = 0; guess < parts; ++guess) {
        ModelWriter writer;
        const Step step{table, value, guess};
        code(writer, step);
        writer.raw(0x5A, 8);
        ModelReader reader(writer.finish());
        ASSERT_EQ(code(reader, step), value) << "of " << parts << ", guess " << guess;
        ASSERT_EQ(reader.raw(0, 8), 0x5Au);
      }
    }
  }
}

TEST(SymbolCoding, GuessIsToldWhatTheCodeSays) {
  // A right guess costs two questions; the search must not go over all symbols.
  const std::uint32_t count = 1u << 20;
  auto cumulative = [](std::uint32_t symbol) { return symbol * 16; };
  Random random(6);
  std::vector<std::uint32_t> values;
  ModelWriter writer;
  for (int i = 0; i < 500; ++i) {
    values.push_back(random.below(count));
    writer.symbol(
        values.back(), count, [](std::uint64_t) { return 0u; }, cumulative);
  }
  ModelReader reader(writer.finish());
  for (std::uint32_t value : values) {
    unsigned asked = 0;
    std::uint64_t told = 0;
    const std::uint32_t got = reader.symbol(
        0, count,
        [&](std::uint64_t scaled) {
          told = scaled;
          return static_cast<std::uint32_t>(std::min<std::uint64_t>(scaled / 16, count - 1));
        },
        [&](std::uint32_t symbol) {
          ++asked;
          return cumulative(symbol);
        });
    ASSERT_EQ(got, value);
    EXPECT_EQ(told / 16, value);
    EXPECT_LE(asked, 3u);
  }
}

TEST(SymbolCoding, SearchIsLogarithmicFromAFarGuess) {
  const std::uint32_t count = 1u << 20;
  for (std::uint32_t guess : {0u, count - 1, count / 3}) {
    for (std::uint32_t value : {0u, 1u, count / 2, count - 2, count - 1}) {
      ModelWriter writer;
      auto cumulative = [](std::uint32_t symbol) { return symbol * 16; };
      writer.symbol(
          value, count, [](std::uint64_t) { return 0u; }, cumulative);
      ModelReader reader(writer.finish());
      unsigned asked = 0;
      ASSERT_EQ(reader.symbol(
                    0, count, [&](std::uint64_t) { return guess; },
                    [&](std::uint32_t symbol) {
                      ++asked;
                      return cumulative(symbol);
                    }),
                value);
      EXPECT_LE(asked, 48u);
    }
  }
}

TEST(SymbolCoding, CostsWhatTheProbabilitiesSay) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const std::vector<Step> steps = random_steps(seed, 3000);
    ModelWriter writer;
    double ideal = 0;
    for (const Step& step : steps) {
      const double width = step.table[step.value + 1] - step.table[step.value];
      ideal -= std::log2(width / step.table.back());
      code(writer, step);
    }
    // Each division loses less than 2^-6 of the range, in the mean far less.
    EXPECT_GE(writer.bits(), ideal - 1) << seed;
    EXPECT_LE(writer.bits(), ideal + 2 + 0.003 * static_cast<double>(steps.size())) << seed;
    const double bits = writer.bits();
    EXPECT_LE(8.0 * static_cast<double>(writer.finish().size()), bits + 16) << seed;
  }
}

TEST(SymbolCoding, AnyBytesGiveAnswersBelowTheCount) {
  Random random(8);
  for (int run = 0; run < 200; ++run) {
    std::vector<std::byte> bytes(random.below(120));
    for (std::byte& b : bytes) b = random.one_in(2) ? std::byte{0xFF} : static_cast<std::byte>(random.below(256));
    ModelReader reader(bytes);
    for (const Step& step : random_steps(static_cast<std::uint64_t>(run), 150)) {
      ASSERT_LT(code(reader, step), step.table.size() - 1);
    }
  }
}

// The sliver beyond the last part, which division leaves and no encoder uses.
TEST(SymbolCoding, CodesBeyondTheLastPartAreTheLastSymbol) {
  const std::vector<std::byte> ones(200, std::byte{0xFF});
  for (std::uint32_t guess : {0u, 1u, 2u}) {
    ModelReader reader(ones);
    const Step step{{0, 5, 7, kMostTotal - 4}, 0, guess};
    for (int i = 0; i < 60; ++i) ASSERT_EQ(code(reader, step), 2u) << i;
    for (int i = 0; i < 60; ++i) ASSERT_LT(reader.raw(0, 7), 128u);
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
