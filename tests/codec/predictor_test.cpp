// SPDX-License-Identifier: MIT
// The predictor on surfaces that it should master, and on rings without any extent, where it may say anything finite.
#include "codec/geometry/predictor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codec/geometry/lanes.h"
#include "codec/geometry/provisional.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

constexpr std::int32_t kMost = (1 << 20) - 1;

struct Scene {
  HalfEdgeMesh mesh;
  std::vector<LatticePoint> points;
  Surface surface;
  Predictor predictor;
};

// Rows of equal quads, each cut the same way. The points are `place(x, y)`.
template <typename Place>
Scene field(std::uint32_t columns, std::uint32_t rows, const Place& place) {
  Scene scene;
  std::vector<Face> faces;
  for (std::uint32_t y = 0; y < rows; ++y) {
    for (std::uint32_t x = 0; x < columns; ++x) {
      scene.points.push_back(place(static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)));
      if (x + 1 == columns || y + 1 == rows) continue;
      const std::uint32_t a = y * columns + x;
      faces.push_back({a, a + 1, a + columns + 1});
      faces.push_back({a, a + columns + 1, a + columns});
    }
  }
  Result<HalfEdgeMesh> built = HalfEdgeMesh::build(faces, scene.points.size());
  EXPECT_TRUE(built.ok());
  scene.mesh = std::move(built).value();
  scene.surface.build(scene.mesh, scene.points, {});
  return scene;
}

bool finite(Four v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]) && v[3] == 0;
}

template <typename Lanes>
bool all_finite(const Lanes& lanes) {
  return std::all_of(lanes.value.begin(), lanes.value.end(), [](float x) { return std::isfinite(x); });
}

bool spread_is_bounded(float cells) {
  return cells >= 0.02f && cells <= 16777216.0f;
}

void expect_finite(const Expectation& e) {
  EXPECT_TRUE(finite(e.position));
  EXPECT_TRUE(finite(e.normal));
  EXPECT_TRUE(finite(e.mean));
  EXPECT_TRUE(spread_is_bounded(e.spread.tangential)) << e.spread.tangential;
  EXPECT_TRUE(spread_is_bounded(e.spread.across)) << e.spread.across;
  for (const Expectation::Fit::Equation& equation : e.equation) EXPECT_TRUE(all_finite(equation));
  EXPECT_TRUE(all_finite(e.spread_terms));
  EXPECT_TRUE(std::isfinite(e.radius) && e.radius >= 1) << e.radius;
  const float size = length(e.normal);
  EXPECT_TRUE(size == 0 || std::abs(size - 1) < 1e-6f) << size;
}

void expect_bounded(const RelativeSpread& spread) {
  EXPECT_TRUE(spread.tangential >= 1e-4f && spread.tangential <= 4) << spread.tangential;
  EXPECT_TRUE(spread.across >= 1e-4f && spread.across <= 4) << spread.across;
}

Expectation expected_at(const Scene& scene, std::uint32_t v, unsigned shift, std::size_t stage) {
  return scene.predictor.expect(collect_ring(scene.mesh, v), scene.surface, v, shift, stage);
}

void move(Scene& scene, std::uint32_t v, const LatticePoint& to) {
  scene.surface.move(scene.mesh, collect_ring(scene.mesh, v), v, to);
}

// The position is known: learns, as decoding does.
void settle(Scene& scene, const Expectation& e, std::uint32_t v, const LatticePoint& to) {
  const RelativeSpread spread = scene.predictor.learn(e, to);
  expect_bounded(spread);
  scene.surface[v].spread = spread;
  move(scene, v, to);
}

// How far the prediction lay off, in half steps.
float distance_from(const Expectation& e, const LatticePoint& truth) {
  Four off = e.position;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    off[axis] -= static_cast<float>(truth[i] - e.origin[i]);
  }
  return length(off);
}

// Forgets where v stands, predicts, puts it back and learns. The distance of the prediction.
float surprise(Scene& scene, std::uint32_t v, unsigned shift = 0, std::size_t stage = 0) {
  // It is the first to be placed, so it alone tells where it would be placed.
  Surface placed = scene.surface;
  place_provisionally(scene.mesh, placed, v, kMost);
  move(scene, v, placed[v].point);
  scene.surface[v].spread = placed[v].spread;
  const Expectation e = expected_at(scene, v, shift, stage);
  expect_finite(e);
  settle(scene, e, v, scene.points[v]);
  return distance_from(e, scene.points[v]);
}

TEST(PredictorTest, MastersAnExactlyPlanarGrid) {
  const std::uint32_t size = 20;
  Scene scene = field(size, size, [](std::int32_t x, std::int32_t y) {
    return LatticePoint{2 * (500 + 31 * x + 4 * y), 2 * (900 - 3 * x + 29 * y), 2 * (700 + 11 * x + 7 * y)};
  });
  Random random(1);
  float worst_early = 0;
  float worst = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::uint32_t v = random.below(size * size);
    if (scene.mesh.face_valence(v) < 3) continue;  // corners: no two others are like them
    const float off = surprise(scene, v);
    if (i < 50) worst_early = std::max(worst_early, off);
    if (i >= 1000) worst = std::max(worst, off);
  }
  EXPECT_LT(worst_early, 40);  // an edge is 64 long
  EXPECT_LT(worst, 1);         // half steps
}

TEST(PredictorTest, LearnsToFollowACurve) {
  const std::uint32_t size = 24;
  Scene scene = field(size, size, [](std::int32_t x, std::int32_t y) {
    const std::int32_t dx = x - 12;
    const std::int32_t dy = y - 12;
    return LatticePoint{2 * (1000 + 60 * x), 2 * (1000 + 60 * y), 2 * (1000 + 4 * (dx * dx + dy * dy))};
  });
  Random random(2);
  float early = 0;
  float late = 0;
  float mean_only = 0;
  for (int i = 0; i < 2500; ++i) {
    const std::uint32_t x = 2 + random.below(size - 4);
    const std::uint32_t y = 2 + random.below(size - 4);
    const std::uint32_t v = y * size + x;
    const Four ring = scene.surface[v].neighbour_mean(four_words(scene.points[v]));
    const float off = surprise(scene, v);
    if (i < 16) {
      early += off / 16;
      mean_only += length(ring) / 16;
    }
    if (i >= 2000) late += off / 500;
  }
  EXPECT_GT(mean_only, 10);
  EXPECT_LT(early, mean_only);
  EXPECT_LT(late, 1);
  EXPECT_LT(late, 0.3f * early);
}

TEST(PredictorTest, SpreadFollowsTheNoise) {
  for (std::int32_t noise : {2, 40}) {
    const auto size_of_noise = static_cast<float>(noise);
    const std::uint32_t size = 20;
    Random random(3);
    Scene scene = field(size, size, [&](std::int32_t x, std::int32_t y) {
      auto off = [&] {
        return static_cast<std::int32_t>(random.below(2 * static_cast<std::uint32_t>(noise) + 1)) - noise;
      };
      return LatticePoint{2 * (2000 + 200 * x), 2 * (2000 + 200 * y), 2 * (2000 + off())};
    });
    for (int i = 0; i < 2000; ++i) surprise(scene, random.below(size * size));
    float across = 0;
    float tangential = 0;
    for (std::uint32_t v = size + 1; v < 2 * size - 1; ++v) {
      const Expectation e = expected_at(scene, v, 0, 0);
      across += e.spread.across / (size - 2);
      tangential += e.spread.tangential / (size - 2);
      EXPECT_GT(std::abs(e.normal[2]), 0.7f);
    }
    // A uniform offset of up to `noise` is off by half of it in the mean, and the prediction is off itself.
    EXPECT_GT(across, 0.3f * size_of_noise);
    EXPECT_LT(across, 1.6f * size_of_noise);
    EXPECT_LT(tangential, 0.5f * size_of_noise + 1);
  }
}

TEST(SpreadModelTest, LearnsWhatTheRingTells) {
  Random random(8);
  SpreadModel model;
  // Across as the bend is, along half the radius; the neighbours say nothing of either.
  auto draw = [&] {
    SpreadModel::Signs signs;
    auto any = [&] { return static_cast<float>(std::ldexp(1 + random.unit(), static_cast<int>(random.below(9)))); };
    signs.radius = any();
    signs.bend = any();
    signs.neighbours = {10, 10};
    return signs;
  };
  for (int i = 0; i < 3000; ++i) {
    const SpreadModel::Signs signs = draw();
    const SpreadModel::Terms terms = SpreadModel::terms(signs, 1);
    const Spread seen{signs.radius * 0.5f, signs.bend};
    const Spread expected = model.expect(terms, 2);
    if (i >= 1000) {
      EXPECT_NEAR(std::log2(expected.tangential / seen.tangential), 0, 0.7);
      EXPECT_NEAR(std::log2(expected.across / seen.across), 0, 0.7);
    }
    model.learn(terms, 2, expected, seen);
  }
}

TEST(SpreadModelTest, GroupsAreCalibratedApart) {
  SpreadModel model;
  SpreadModel::Signs signs;
  signs.radius = 100;
  signs.neighbours = {10, 10};
  const SpreadModel::Terms terms = SpreadModel::terms(signs, 1);
  for (int i = 0; i < 1000; ++i) {
    model.learn(terms, 1, model.expect(terms, 1), {4, 4});
    model.learn(terms, 7, model.expect(terms, 7), {64, 64});
  }
  EXPECT_NEAR(model.expect(terms, 1).across, 4, 1);
  EXPECT_NEAR(model.expect(terms, 7).across, 64, 8);
  EXPECT_NEAR(model.expect(terms, 7).tangential, 64, 8);
}

// In cells of any size, whatever the unit: only the quotients matter.
TEST(SpreadModelTest, TermsAreLogarithmsOfCells) {
  SpreadModel::Signs signs;
  signs.radius = 64;
  signs.neighbours = {32, 16};
  signs.unevenness = 8;
  signs.parallelogram_across = 4;
  signs.parallelogram_tangential = 128;
  signs.crowding = 256;
  signs.bend = 512;
  const SpreadModel::Terms terms = SpreadModel::terms(signs, 0.5f);
  const std::array<float, SpreadModel::kSigns + 1> wanted{1, 32, 16, 8, 4, 2, 64, 128, 256};
  EXPECT_EQ(terms.value[0], 1);
  for (std::size_t i = 1; i < wanted.size(); ++i) {
    EXPECT_NEAR(terms.value[i], std::log2(wanted[i] + 0.1f), 1.1e-3) << i;
  }
  for (std::size_t i = wanted.size(); i < terms.value.size(); ++i) EXPECT_EQ(terms.value[i], 0) << i;
  // Nothing at all has a logarithm too.
  for (float term : SpreadModel::terms({}, 1).value) EXPECT_TRUE(std::isfinite(term));
}

TEST(PredictorTest, StagesLearnApart) {
  Scene scene = field(10, 10, [](std::int32_t x, std::int32_t y) {
    return LatticePoint{2 * (1000 + 60 * x), 2 * (1000 + 60 * y), 2 * (1000 + 4 * (x * x + y * y))};
  });
  const Expectation before = expected_at(scene, 55, 0, 1);
  for (int i = 0; i < 200; ++i) surprise(scene, 22 + static_cast<std::uint32_t>(i % 5), 0, 0);
  const Expectation after = expected_at(scene, 55, 0, 1);
  EXPECT_EQ(before.origin, after.origin);
  EXPECT_EQ(length(before.position - after.position), 0);
  EXPECT_EQ(after.stage, 1u);
}

TEST(PredictorTest, AtTheBorderTheGuessStartsFromItsLine) {
  Scene scene = field(8, 8, [](std::int32_t x, std::int32_t y) { return LatticePoint{200 * x, 200 * y, 1000}; });
  move(scene, 3, {650, 30, 900});
  ASSERT_TRUE(collect_ring(scene.mesh, 3).border);
  const Expectation e = expected_at(scene, 3, 0, 0);
  EXPECT_EQ(e.origin, (LatticePoint{650, 30, 900}));
  EXPECT_EQ(e.mean[0], 600 - 650);
  EXPECT_EQ(e.mean[1], 0 - 30);
  EXPECT_EQ(e.mean[2], 1000 - 900);
}

// All is relative to where the vertex stands: elsewhere on the lattice the same bits come out, and learning too.
TEST(PredictorTest, PlaceOnTheLatticeDoesNotMatter) {
  auto field_at = [](std::int32_t offset) {
    return field(9, 9, [&](std::int32_t x, std::int32_t y) {
      return LatticePoint{offset + 2 * (60 * x + y), offset + 2 * (60 * y - x * x + 100),
                          offset + 2 * (4 * (x * x + y * y) + (x * 7 + y * 3) % 5)};
    });
  };
  Scene here = field_at(0);
  Scene far = field_at(1 << 24);
  for (int round = 0; round < 30; ++round) {
    for (std::uint32_t v = 10; v < 71; ++v) {
      const Expectation a = expected_at(here, v, 0, 0);
      const Expectation b = expected_at(far, v, 0, 0);
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(a.position[axis], b.position[axis]) << v;
        ASSERT_EQ(a.normal[axis], b.normal[axis]) << v;
      }
      ASSERT_EQ(a.spread.across, b.spread.across);
      ASSERT_EQ(a.spread.tangential, b.spread.tangential);
      settle(here, a, v, here.points[v]);
      settle(far, b, v, far.points[v]);
    }
  }
}

TEST(PredictorTest, NoExtentIsNoTrouble) {
  Random random(5);
  const std::vector<std::vector<LatticePoint>> lines = {
      {{0, 0, 0}}, {{kMost, kMost, kMost}}, {{5, 0, 0}, {9, 0, 0}, {70, 0, 0}}, {{0, 0, 0}, {kMost, kMost, kMost}}};
  for (const TriangleMesh& mesh : {sphere(1), grid(5, 5, 0), bipyramid(30), cone(20), single_triangle()}) {
    for (const std::vector<LatticePoint>& line : lines) {
      Scene scene;
      Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
      ASSERT_TRUE(built.ok());
      scene.mesh = std::move(built).value();
      for (std::size_t v = 0; v < mesh.positions.size(); ++v) scene.points.push_back(line[random.below(line.size())]);
      scene.surface.build(scene.mesh, scene.points, {});
      for (int i = 0; i < 1500; ++i) {
        surprise(scene, random.below(scene.points.size()), random.below(16), random.below(kStages));
        if (HasFailure()) return;
      }
    }
  }
}

TEST(PredictorTest, ExtremePointsStayFinite) {
  Random random(6);
  constexpr std::int32_t kFar = (1 << 25) - 2;
  const TriangleMesh mesh = sphere(2);
  Scene scene;
  Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  ASSERT_TRUE(built.ok());
  scene.mesh = std::move(built).value();
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) scene.points.push_back({0, kFar, 0});
  scene.surface.build(scene.mesh, scene.points, {});
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t v = random.below(scene.points.size());
    const std::size_t stage = random.below(kStages);
    const Expectation e = expected_at(scene, v, 0, stage);
    expect_finite(e);
    LatticePoint to{};
    for (std::int32_t& c : to)
      c = random.one_in(3) ? static_cast<std::int32_t>(random.below(kFar)) : (random.one_in(2) ? 0 : kFar);
    settle(scene, e, v, to);
    if (HasFailure()) return;
  }
}

TEST(Provisional, StaysWithinTheLattice) {
  Random random(7);
  for (std::int32_t most : {30, kMost, (1 << 25) - 2}) {
    auto end = [&] { return random.one_in(2) ? 0 : most; };
    Scene scene = field(9, 9, [&](std::int32_t, std::int32_t) { return LatticePoint{end(), end(), end()}; });
    const auto count = static_cast<std::uint32_t>(scene.points.size());
    for (int i = 0; i < 500; ++i) {
      const std::uint32_t first = random.below(count);
      const Surface before = scene.surface;
      place_provisionally(scene.mesh, scene.surface, first, most);
      for (std::uint32_t v = 0; v < count; ++v) {
        for (std::int32_t c : scene.surface[v].point) ASSERT_TRUE(c >= 0 && c <= most) << c;
        if (v < first) {
          ASSERT_EQ(scene.surface[v].point, before[v].point);
        }
      }
      for (int moves = 0; moves < 20; ++moves) {
        move(scene, random.below(count), {end(), end(), most});
      }
    }
    place_provisionally(scene.mesh, scene.surface, count, most);  // nobody
  }
}

TEST(Provisional, HandsOverTheMeanSpreadOfTheRing) {
  Scene scene = field(5, 5, [](std::int32_t x, std::int32_t y) { return LatticePoint{20 * x, 20 * y, 10}; });
  for (std::uint32_t v = 0; v < 25; ++v) scene.surface[v].spread = {static_cast<float>(v), static_cast<float>(2 * v)};
  const Ring ring = collect_ring(scene.mesh, 24);
  float sum = 0;
  for (std::size_t i = 0; i < ring.size; ++i) sum += static_cast<float>(ring.vertex[i]);
  place_provisionally(scene.mesh, scene.surface, 24, kMost);
  EXPECT_FLOAT_EQ(scene.surface[24].spread.tangential, sum / static_cast<float>(ring.size));
  EXPECT_FLOAT_EQ(scene.surface[24].spread.across, 2 * sum / static_cast<float>(ring.size));
  EXPECT_EQ(scene.surface[23].spread.tangential, 23);
}

// A flat, even grid is where the ring's mean is the answer.
TEST(Provisional, FindsItsPlaceInAnEvenPlane) {
  Scene scene = field(9, 9, [](std::int32_t x, std::int32_t y) {
    return LatticePoint{200 + 40 * x, 100 + 36 * y, 500 + 2 * x + 6 * y};
  });
  const std::uint32_t v = 4 * 9 + 4;
  move(scene, v, {0, 0, 0});
  move(scene, v, {370, 230, 560});
  Surface placed = scene.surface;
  place_provisionally(scene.mesh, placed, v, kMost);
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(placed[v].point[axis], scene.points[v][axis], 4) << axis;
}

}  // namespace
}  // namespace pmcd::codec::testing
