// SPDX-License-Identifier: MIT
// Positions under whatever expectation: every cell comes back, and the values that rings repeat are counted in cells.
#include "codec/geometry/position_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/codec/coding.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

// Expectations that no mesh would give.
Expectation any_expectation(Random& random, std::int32_t most, unsigned shift) {
  Expectation e;
  e.cell = static_cast<double>(2u << shift);
  e.ring.size = 4;
  e.ring.vertex = {0, 1, 2, 3};
  e.ring.apex.fill(kNone);
  e.ring.apex[1] = 4;
  const double extent = (most + 1.0) * e.cell;
  Vec n{random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5};
  if (random.one_in(4)) n[random.below(3)] = 0;
  if (random.one_in(4)) n = {0.5, 0.5, random.one_in(2) ? 0.5 : -0.5};
  if (length(n) > 1e-3 && !random.one_in(8)) e.normal = n * (1 / length(n));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    e.position[axis] = (random.unit() * (random.one_in(5) ? 4 : 1) - (random.one_in(5) ? 2 : 0)) * extent;
  }
  auto spread = [&] {
    if (random.one_in(4)) return random.one_in(2) ? 0.02 : 16777216.0;
    return 0.02 + std::ldexp(random.unit(), static_cast<int>(random.below(25)));
  };
  e.spread = {spread(), spread()};
  return e;
}

TEST(PositionCoder, AnyExpectationBringsEveryCellBack) {
  struct Case {
    Expectation e;
    std::int32_t most;
    unsigned shift;
    unsigned digits;  // 0: all
    LatticePoint cell;
  };
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    Random random(seed);
    std::vector<Case> cases;
    for (int i = 0; i < 500; ++i) {
      Case c;
      const unsigned bits = 4 + random.below(21);
      c.shift = random.below(bits - 3);
      c.most = ((1 << bits) - 1) >> c.shift;
      c.digits = random.one_in(3) ? random.below(std::min(bits - c.shift, CoordinateModel::kMostDigits + 1)) : 0;
      c.e = any_expectation(random, c.most, c.shift);
      for (std::int32_t& x : c.cell)
        x = static_cast<std::int32_t>(random.below(static_cast<std::uint64_t>(c.most) + 1));
      cases.push_back(c);
    }
    std::vector<LatticePoint> points(5);
    for (LatticePoint& p : points) {
      for (std::int32_t& x : p) x = static_cast<std::int32_t>(random.below(1u << 25));
    }
    auto code = [&](auto& source, PositionModels& models, const Case& c, const LatticePoint& wanted,
                    LatticePoint& got) {
      const LatticePoint known = cell_of(c.cell, c.digits);
      return code_position(models, source, points, c.e, c.most, c.shift, c.digits > 0 ? &known : nullptr, c.digits,
                           wanted, got);
    };
    ModelWriter writer;
    PositionModels out;
    out.structured = seed % 2 == 1;
    for (const Case& c : cases) {
      LatticePoint got{};
      ASSERT_TRUE(code(writer, out, c, c.cell, got));
      ASSERT_EQ(got, c.cell);
    }
    ModelReader reader(writer.finish());
    PositionModels in;
    in.structured = out.structured;
    for (const Case& c : cases) {
      LatticePoint got{};
      ASSERT_TRUE(code(reader, in, c, {}, got));
      ASSERT_EQ(got, c.cell);
    }
    EXPECT_TRUE(reader.at_end());
  }
}

TEST(PositionCoder, MostFrequentValueIsCountedInCells) {
  const std::vector<LatticePoint> points = {{8, 0, 1}, {9, 0, 2}, {40, 0, 3}, {15, 0, 4}, {24, 0, 5}};
  Ring ring;
  ring.size = 4;
  ring.vertex = {0, 1, 2, 3};
  ring.apex = {4, kNone, 4, kNone};
  std::int32_t value = -1;
  EXPECT_EQ(most_frequent(points, ring, 0, 0, 0, value), 2u);  // 8 and 9 are the same lattice point
  EXPECT_EQ(value, 4);
  EXPECT_EQ(most_frequent(points, ring, 0, 0, 2, value), 3u);  // cells of four
  EXPECT_EQ(value, 1);
  EXPECT_EQ(most_frequent(points, ring, 1, 0, 0, value), 4u);
  EXPECT_EQ(value, 0);
  // Corners 8 + 9 - 24 < 0, which does not count, and 40 + 15 - 24 = 31.
  EXPECT_EQ(most_frequent(points, ring, 0, 1, 0, value), 1u);
  EXPECT_EQ(value, 15);
  ring.apex.fill(kNone);
  EXPECT_EQ(most_frequent(points, ring, 0, 1, 0, value), 0u);
}

}  // namespace
}  // namespace pmcd::codec::testing
