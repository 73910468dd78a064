// SPDX-License-Identifier: MIT
// Positions under whatever expectation: every cell comes back, and the values that rings repeat are counted in cells.
#include "codec/geometry/position_coder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codec/geometry/lanes.h"
#include "tests/codec/coding.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

// Vertices without a mesh.
Surface standing_at(const std::vector<LatticePoint>& points) {
  Surface surface;
  surface.build(HalfEdgeMesh(), points, {});
  return surface;
}

// Of vertices 0 to 3; 4 lies beyond one of its edges.
Ring four_ring() {
  Ring ring;
  ring.size = 4;
  ring.vertex = {0, 1, 2, 3};
  ring.apex.fill(kNone);
  ring.apex[1] = 4;
  return ring;
}

// Expectations that no mesh would give.
Expectation any_expectation(Random& random, std::int32_t most, unsigned shift) {
  Expectation e;
  e.cell = static_cast<float>(2u << shift);
  const double extent = (most + 1.0) * static_cast<double>(e.cell);
  auto real = [](double value) { return static_cast<float>(value); };
  Four n{real(random.unit() - 0.5), real(random.unit() - 0.5), real(random.unit() - 0.5), 0};
  if (random.one_in(4)) n[random.below(3)] = 0;
  if (random.one_in(4)) n = Four{0.5f, 0.5f, random.one_in(2) ? 0.5f : -0.5f, 0};
  if (length(n) > 1e-3f && !random.one_in(8)) e.normal = n * (1 / length(n));
  for (int axis = 0; axis < 3; ++axis) {
    const double at = (random.unit() * (random.one_in(5) ? 4 : 1) - (random.one_in(5) ? 2 : 0)) * extent;
    const double origin = random.one_in(3) ? 0 : random.unit() * extent;
    e.origin[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::min(origin, extent - 1));
    e.position[axis] = real(at - origin);
  }
  auto spread = [&] {
    if (random.one_in(4)) return random.one_in(2) ? 0.02f : 16777216.0f;
    return std::min(real(0.02 + std::ldexp(random.unit(), static_cast<int>(random.below(25)))), 16777216.0f);
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
    const Surface surface = standing_at(points);
    auto code = [&](auto& source, PositionModels& models, const Case& c, const LatticePoint& wanted,
                    LatticePoint& got) {
      const LatticePoint known = cell_of(c.cell, c.digits);
      return code_position(models, source, surface, four_ring(), c.e, c.most, c.shift, c.digits > 0 ? &known : nullptr,
                           c.digits, wanted, got);
    };
    ModelWriter writer;
    PositionModels out;
    out.repetition.structure = static_cast<Structure>(seed % 3);
    auto reflect = [&](PositionModels& models) {
      if (seed % 2 == 0) return;
      models.repetition.reflection.flips[seed % 3] = true;
      models.repetition.reflection.sum[seed % 3] = 1 << 24;
      models.repetition.images.begin(models.repetition.reflection, points.size(), 1 << 25);
      for (const LatticePoint& p : points) models.repetition.images.add(p);
    };
    reflect(out);
    for (const Case& c : cases) {
      LatticePoint got{};
      ASSERT_TRUE(code(writer, out, c, c.cell, got));
      ASSERT_EQ(got, c.cell);
    }
    ModelReader reader(writer.finish());
    PositionModels in;
    in.repetition.structure = out.repetition.structure;
    reflect(in);
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
  const Surface surface = standing_at(points);
  Ring ring = four_ring();
  ring.apex = {4, kNone, 4, kNone};
  Repeated repeated;
  repeated = most_frequent(surface, ring, Repeat::coordinate, 0);  // 8 and 9 are the same lattice point
  EXPECT_EQ(repeated.times[0], 2);
  EXPECT_EQ(repeated.value[0], 4);
  repeated = most_frequent(surface, ring, Repeat::coordinate, 2);  // cells of four
  EXPECT_EQ(repeated.times[0], 3);
  EXPECT_EQ(repeated.value[0], 1);
  repeated = most_frequent(surface, ring, Repeat::coordinate, 0);
  EXPECT_EQ(repeated.times[1], 4);
  EXPECT_EQ(repeated.value[1], 0);
  // Corners 8 + 9 - 24 < 0, which does not count, and 40 + 15 - 24 = 31.
  repeated = most_frequent(surface, ring, Repeat::corner, 0);
  EXPECT_EQ(repeated.times[0], 1);
  EXPECT_EQ(repeated.value[0], 15);
  ring.apex.fill(kNone);
  repeated = most_frequent(surface, ring, Repeat::corner, 0);
  EXPECT_EQ(repeated.times[0], 0);
}

class RepeatedValuesTest : public ::testing::Test {
 protected:
  // Of the coordinate that is expected at 20 give or take 4.
  std::vector<RepeatedValue> expected(RepeatedValues& values, std::size_t i) {
    const std::span<const RepeatedValue> answer = values.expect(i, 20, 4, cell_, 4);
    return {answer.begin(), answer.end()};
  }
  RepeatedValues of_vertex(unsigned shift = 0) {
    return {repetition_, surface_, four_ring(), axis_, mean_, 100, shift};
  }

  Repetition repetition_;
  Surface surface_ = standing_at({{40, 0, 0}, {41, 0, 0}, {80, 0, 0}, {40, 0, 0}, {0, 0, 0}});
  std::array<std::size_t, 3> axis_ = {0, 1, 2};
  std::array<double, 3> mean_ = {20, 20, 20};
  LatticePoint cell_{};
};

TEST_F(RepeatedValuesTest, StructureSaysWhatIsLookedFor) {
  EXPECT_FALSE(repetition_.any());
  auto kinds = [&] {
    RepeatedValues values = of_vertex();
    std::vector<std::size_t> all;
    for (const RepeatedValue& r : expected(values, 0)) all.push_back(r.kind);
    return all;
  };
  repetition_.structure = Structure::values;
  EXPECT_EQ(kinds(), (std::vector<std::size_t>{3}));
  repetition_.structure = Structure::all;
  EXPECT_EQ(kinds(), (std::vector<std::size_t>{0, 1, 2, 3}));
  {
    RepeatedValues values = of_vertex();
    EXPECT_EQ(expected(values, 0)[1].value, 60);  // the corner: 41 + 80 - 0, in cells
  }
  repetition_.reflection.flips[0] = true;
  repetition_.reflection.sum[0] = 200;
  repetition_.images.begin(repetition_.reflection, 10, 200);
  repetition_.images.add({160, 40, 46});
  EXPECT_EQ(kinds(), (std::vector<std::size_t>{0, 1, 2, 3}));
  {
    RepeatedValues values = of_vertex();
    EXPECT_EQ(expected(values, 0)[1].value, 20) << "the image instead";
  }
  repetition_.structure = Structure::values;
  EXPECT_EQ(kinds(), (std::vector<std::size_t>{1, 3}));
  repetition_.structure = Structure::none;
  EXPECT_EQ(kinds(), (std::vector<std::size_t>{1}));
}

TEST_F(RepeatedValuesTest, ContextsTellTimesOutcomeAndDistance) {
  repetition_.structure = Structure::all;
  RepeatedValues values = of_vertex();
  std::vector<RepeatedValue> first = expected(values, 0);
  EXPECT_EQ(first[0].value, 20);  // of the ring, three times
  EXPECT_EQ(first[0].context, (3u * 3 + 0) * 4 + 0);
  EXPECT_EQ(first[3].context, (0u * 3 + 0) * 4 + 0);  // nothing came yet: its value is the centre
  values.learn(0, 20);
  EXPECT_EQ(expected(values, 1)[0].context, (4u * 3 + 1) * 4 + 3);  // 0, four times; the ring hit before; 20 away
  values.learn(1, 17);
  EXPECT_EQ(expected(values, 2)[0].context, (4u * 3 + 2) * 4 + 3);
  // 20 came once on the first axis.
  RepeatedValues next = of_vertex();
  first = expected(next, 0);
  EXPECT_EQ(first[3].value, 20);
  EXPECT_EQ(first[3].context, (1u * 3 + 0) * 4 + 0);
}

TEST_F(RepeatedValuesTest, WithoutAnImageNothingIsRemembered) {
  repetition_.reflection.flips[0] = true;
  repetition_.reflection.sum[0] = 200;
  repetition_.images.begin(repetition_.reflection, 10, 200);
  repetition_.images.add({160, 40, 46});  // its image stands at 40, 40, 46
  RepeatedValues values = of_vertex();
  EXPECT_EQ(expected(values, 0)[0].value, 20);
  values.learn(0, 60);  // so it was not that one
  cell_[0] = 60;
  const RepeatedValue second = expected(values, 1)[0];
  EXPECT_EQ(second.value, 0);
  EXPECT_EQ(second.context / 12, 0u);
}

TEST(PositionCoder, MiddlesBetweenOppositeVerticesAreRounded) {
  const Surface surface = standing_at({{8, 0, 1}, {10, 0, 2}, {40, 0, 5}, {39, 0, 4}, {24, 0, 5}});
  Ring ring = four_ring();
  Repeated repeated;
  // 8 and 40, 10 and 39, each from either end: (48 + 2) / 2 and (49 + 2) / 2 half steps.
  repeated = most_frequent(surface, ring, Repeat::middle, 0);
  EXPECT_EQ(repeated.times[0], 4);
  EXPECT_EQ(repeated.value[0], 12);
  repeated = most_frequent(surface, ring, Repeat::middle, 0);
  EXPECT_EQ(repeated.times[2], 4);
  EXPECT_EQ(repeated.value[2], 2);
  repeated = most_frequent(surface, ring, Repeat::middle, 2);
  EXPECT_EQ(repeated.times[0], 4);
  EXPECT_EQ(repeated.value[0], 3);
  // Of five the opposite is two further on: (8 + 40), (10 + 39) and (39 + 8) come to the same.
  ring.size = 5;
  ring.vertex[4] = 4;
  repeated = most_frequent(surface, ring, Repeat::middle, 0);
  EXPECT_EQ(repeated.times[0], 3);
  EXPECT_EQ(repeated.value[0], 12);
  ring.border = true;
  repeated = most_frequent(surface, ring, Repeat::middle, 0);
  EXPECT_EQ(repeated.times[0], 0);
}

}  // namespace
}  // namespace pmcd::codec::testing
