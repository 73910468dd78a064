// SPDX-License-Identifier: MIT
// The predictor on surfaces that it should master, and on rings without any extent, where it may say anything finite.
#include "codec/geometry/predictor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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
  scene.surface.build(scene.mesh, scene.points);
  return scene;
}

bool finite(const Vec& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void expect_finite(const Expectation& e) {
  EXPECT_TRUE(finite(e.position));
  EXPECT_TRUE(finite(e.normal));
  EXPECT_TRUE(finite(e.mean));
  EXPECT_TRUE(e.spread.tangential >= 0.02 && e.spread.tangential <= 16777216.0);
  EXPECT_TRUE(e.spread.across >= 0.02 && e.spread.across <= 16777216.0);
  for (const Vec& feature : e.feature) EXPECT_TRUE(finite(feature));
  for (double term : e.spread_terms) EXPECT_TRUE(std::isfinite(term));
  const double size = length(e.normal);
  EXPECT_TRUE(size == 0 || std::abs(size - 1) < 1e-9) << size;
}

// Forgets where v stands, predicts, puts it back and learns, as decoding does. The distance of the prediction.
double surprise(Scene& scene, std::uint32_t v, unsigned shift = 0, std::size_t stage = 0) {
  const LatticePoint truth = scene.points[v];
  place_provisionally(scene.mesh, scene.points, scene.surface, v, kMost);
  const Expectation e = scene.predictor.expect(scene.mesh, scene.points, scene.surface, v, shift, stage);
  expect_finite(e);
  scene.predictor.learn(e, v, truth, scene.surface);
  scene.surface.moved(scene.mesh, scene.points, v, scene.points[v], truth);
  scene.points[v] = truth;
  return length(e.position - to_vec(truth));
}

TEST(PredictorTest, MastersAnExactlyPlanarGrid) {
  const std::uint32_t size = 20;
  Scene scene = field(size, size, [](std::int32_t x, std::int32_t y) {
    return LatticePoint{2 * (500 + 31 * x + 4 * y), 2 * (900 - 3 * x + 29 * y), 2 * (700 + 11 * x + 7 * y)};
  });
  Random random(1);
  double worst_early = 0;
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::uint32_t v = random.below(size * size);
    if (scene.mesh.face_valence(v) < 3) continue;  // corners: no two others are like them
    const double off = surprise(scene, v);
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
  double early = 0;
  double late = 0;
  double mean_only = 0;
  for (int i = 0; i < 2500; ++i) {
    const std::uint32_t x = 2 + random.below(size - 4);
    const std::uint32_t y = 2 + random.below(size - 4);
    const std::uint32_t v = y * size + x;
    Vec ring{};
    scene.mesh.for_each_neighbour(v, [&](std::uint32_t w) { ring = ring + to_vec(scene.points[w]) * (1.0 / 6); });
    const double off = surprise(scene, v);
    if (i < 16) {
      early += off / 16;
      mean_only += length(ring - to_vec(scene.points[v])) / 16;
    }
    if (i >= 2000) late += off / 500;
  }
  EXPECT_GT(mean_only, 10);
  EXPECT_LT(early, mean_only);
  EXPECT_LT(late, 1);
  EXPECT_LT(late, 0.3 * early);
}

TEST(PredictorTest, SpreadFollowsTheNoise) {
  for (std::int32_t noise : {2, 40}) {
    const std::uint32_t size = 20;
    Random random(3);
    Scene scene = field(size, size, [&](std::int32_t x, std::int32_t y) {
      auto off = [&] {
        return static_cast<std::int32_t>(random.below(2 * static_cast<std::uint32_t>(noise) + 1)) - noise;
      };
      return LatticePoint{2 * (2000 + 200 * x), 2 * (2000 + 200 * y), 2 * (2000 + off())};
    });
    for (int i = 0; i < 2000; ++i) surprise(scene, random.below(size * size));
    double across = 0;
    double tangential = 0;
    for (std::uint32_t v = size + 1; v < 2 * size - 1; ++v) {
      const Expectation e = scene.predictor.expect(scene.mesh, scene.points, scene.surface, v, 0, 0);
      across += e.spread.across / (size - 2);
      tangential += e.spread.tangential / (size - 2);
      EXPECT_GT(std::abs(e.normal.z), 0.7);
    }
    // A uniform offset of up to `noise` is off by half of it in the mean, and the prediction is off itself.
    EXPECT_GT(across, 0.3 * noise);
    EXPECT_LT(across, 1.6 * noise);
    EXPECT_LT(tangential, 0.5 * noise + 1);
  }
}

TEST(SpreadModelTest, LearnsWhatTheRingTells) {
  Random random(8);
  SpreadModel model;
  // Across as the bend is, along half the radius; the neighbours say nothing of either.
  auto draw = [&] {
    SpreadModel::Signs signs;
    signs.radius = std::ldexp(1 + random.unit(), static_cast<int>(random.below(9)));
    signs.bend = std::ldexp(1 + random.unit(), static_cast<int>(random.below(9)));
    signs.neighbours = {10, 10};
    return signs;
  };
  for (int i = 0; i < 3000; ++i) {
    const SpreadModel::Signs signs = draw();
    const SpreadModel::Terms terms = SpreadModel::terms(signs, 1);
    const Spread seen{signs.radius * 0.5, signs.bend};
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

TEST(PredictorTest, StagesLearnApart) {
  Scene scene = field(10, 10, [](std::int32_t x, std::int32_t y) {
    return LatticePoint{2 * (1000 + 60 * x), 2 * (1000 + 60 * y), 2 * (1000 + 4 * (x * x + y * y))};
  });
  const Expectation before = scene.predictor.expect(scene.mesh, scene.points, scene.surface, 55, 0, 1);
  for (int i = 0; i < 200; ++i) surprise(scene, 22 + static_cast<std::uint32_t>(i % 5), 0, 0);
  const Expectation after = scene.predictor.expect(scene.mesh, scene.points, scene.surface, 55, 0, 1);
  EXPECT_EQ(length(before.position - after.position), 0);
  EXPECT_EQ(after.stage, 1u);
}

TEST(PredictorTest, AtTheBorderTheGuessStartsFromItsLine) {
  Scene scene = field(8, 8, [](std::int32_t x, std::int32_t y) { return LatticePoint{200 * x, 200 * y, 1000}; });
  const Expectation e = scene.predictor.expect(scene.mesh, scene.points, scene.surface, 3, 0, 0);
  EXPECT_TRUE(e.ring.border);
  EXPECT_EQ(e.mean.x, 600);
  EXPECT_EQ(e.mean.y, 0);
  EXPECT_EQ(e.mean.z, 1000);
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
      scene.surface.build(scene.mesh, scene.points);
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
  scene.surface.build(scene.mesh, scene.points);
  for (int i = 0; i < 20000; ++i) {
    const std::uint32_t v = random.below(scene.points.size());
    const std::size_t stage = random.below(kStages);
    const Expectation e = scene.predictor.expect(scene.mesh, scene.points, scene.surface, v, 0, stage);
    expect_finite(e);
    if (HasFailure()) return;
    LatticePoint to{};
    for (std::int32_t& c : to)
      c = random.one_in(3) ? static_cast<std::int32_t>(random.below(kFar)) : (random.one_in(2) ? 0 : kFar);
    scene.predictor.learn(e, v, to, scene.surface);
    EXPECT_TRUE(scene.surface[v].tangential >= 1e-4f && scene.surface[v].tangential <= 4);
    EXPECT_TRUE(scene.surface[v].across >= 1e-4f && scene.surface[v].across <= 4);
    scene.surface.moved(scene.mesh, scene.points, v, scene.points[v], to);
    scene.points[v] = to;
  }
}

TEST(Provisional, StaysWithinTheLattice) {
  Random random(7);
  Scene scene = field(9, 9, [&](std::int32_t, std::int32_t) {
    auto end = [&] { return random.one_in(2) ? 0 : kMost; };
    return LatticePoint{end(), end(), end()};
  });
  for (int i = 0; i < 2000; ++i) {
    const std::uint32_t v = random.below(scene.points.size());
    place_provisionally(scene.mesh, scene.points, scene.surface, v, kMost);
    for (std::int32_t c : scene.points[v]) ASSERT_TRUE(c >= 0 && c <= kMost);
    if (random.one_in(3)) {
      const LatticePoint to{random.one_in(2) ? 0 : kMost, random.one_in(2) ? 0 : kMost, kMost};
      scene.surface.moved(scene.mesh, scene.points, v, scene.points[v], to);
      scene.points[v] = to;
    }
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
