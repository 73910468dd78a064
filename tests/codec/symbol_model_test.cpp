// SPDX-License-Identifier: MIT
// When a face is decided by itself and when with the patches before it, and that both learn. What the bits are worth is
// the bench's business.
#include "codec/conquest/symbol_model.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

// Writes nothing down but the chances.
struct Chances {
  std::vector<std::uint32_t> of_not;
  bool bit_at(std::uint32_t p0, bool value) {
    of_not.push_back(p0);
    return value;
  }
};

// Before any gate of a mesh of which nothing is decided.
struct GateScene {
  TriangleMesh triangles = sphere(3);
  HalfEdgeMesh mesh = HalfEdgeMesh::build(triangles.faces, triangles.positions.size()).value();
  Marks marks;
  std::vector<LatticePoint> points;
  Surroundings surroundings;

  GateScene() : points(points_of(triangles)), surroundings(mesh, points, PassKind::decimating, 0, mesh.vertex_count()) {
    marks.clear(mesh);
  }
  static std::vector<LatticePoint> points_of(const TriangleMesh& of) {
    std::vector<LatticePoint> points;
    for (const Position& p : of.positions) {
      LatticePoint point{};
      for (std::size_t axis = 0; axis < 3; ++axis) point[axis] = static_cast<std::int32_t>(2000 * (p[axis] + 1));
      points.push_back(point);
    }
    return points;
  }
  // The chances against each answer that was asked for until it was `wanted`.
  std::vector<std::uint32_t> ask(SymbolModel& model, std::uint32_t face, Symbol wanted) {
    Chances chances;
    const Hypothesis* holds =
        model.code(chances, surroundings, mesh, marks, HalfEdgeMesh::halfedge(face, 0), Tag::plus, Tag::minus, wanted);
    EXPECT_TRUE(holds != nullptr && holds->symbol == wanted);
    return chances.of_not;
  }
};

TEST(SymbolModelTest, WhereAllFacesAreClearTheyComeFirstAndPatchesAmongThemselves) {
  GateScene scene;
  SymbolModel model(PassKind::decimating);
  model.set_clear(0);
  EXPECT_EQ(scene.ask(model, 0, kNull).size(), 1u);
  // 6, 5, 4, 3: the last needs no bit of its own.
  EXPECT_EQ(scene.ask(model, 0, 6).size(), 2u);
  EXPECT_EQ(scene.ask(model, 0, 4).size(), 4u);
  EXPECT_EQ(scene.ask(model, 0, 3).size(), 4u);
}

TEST(SymbolModelTest, WhereNoFaceIsClearThePatchesShareInTheFirstDecision) {
  GateScene scene;
  SymbolModel alone(PassKind::decimating);
  alone.set_clear(0);
  SymbolModel together(PassKind::decimating);
  together.set_clear(1);
  const auto first = scene.ask(alone, 5, 3);
  const auto second = scene.ask(together, 5, 3);
  ASSERT_EQ(first.size(), 4u);
  ASSERT_EQ(second.size(), 4u);
  EXPECT_NE(first[0], second[0]);
  // The rest is a matter of patches only.
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(first[i], second[i], 12) << i;
}

TEST(SymbolModelTest, AFaceIsClearIfItsShareIsAboveTheBound) {
  GateScene scene;
  SymbolModel model(PassKind::decimating);
  model.set_clear(0);
  const double share = 1 - scene.ask(model, 9, kNull)[0] / 65536.0;
  ASSERT_TRUE(share > 0.01 && share < 0.99) << share;
  SymbolModel below(PassKind::decimating);
  below.set_clear(static_cast<float>(share - 0.001));
  SymbolModel above(PassKind::decimating);
  above.set_clear(static_cast<float>(share + 0.001));
  SymbolModel together(PassKind::decimating);
  together.set_clear(1);
  EXPECT_NEAR(1 - scene.ask(below, 9, kNull)[0] / 65536.0, share, 1e-4);
  EXPECT_EQ(scene.ask(above, 9, kNull), scene.ask(together, 9, kNull));
}

TEST(SymbolModelTest, WhatComesOftenBecomesCheap) {
  for (const float clear : {0.0f, 1.0f}) {
    for (const Symbol often : {kNull, Symbol{5}}) {
      GateScene scene;
      SymbolModel model(PassKind::decimating);
      model.set_clear(clear);
      auto cost = [&] {  // as a probability
        const auto chances = scene.ask(model, 3, often);
        double all = 1;
        for (std::size_t i = 0; i + 1 < chances.size(); ++i) all *= chances[i] / 65536.0;
        return all * (1 - chances.back() / 65536.0);
      };
      const double before = cost();
      for (int i = 0; i < 100; ++i) cost();
      EXPECT_GT(cost(), std::min(0.9, 2 * before)) << clear << " " << int{often};
    }
  }
}

// The face learns from what is decided together with the patches too, so that it is right when it is asked alone.
TEST(SymbolModelTest, FacesLearnWhileTheyAreNotClear) {
  GateScene scene;
  SymbolModel model(PassKind::decimating);
  model.set_clear(1);
  for (int i = 0; i < 200; ++i) scene.ask(model, 3, 6);
  model.set_clear(0);
  EXPECT_GT(scene.ask(model, 3, 6)[0], 0.9 * 65536);
}

}  // namespace
}  // namespace pmcd::codec::testing
