// SPDX-License-Identifier: MIT
// What is planned before anything is written: the base that decimation leaves, in numbers of its own.
#include "codec/encoder/encoding_plan.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "codec/encoder/decimation.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

void expect_whole(const Descent& descent, const EncodingPlan& plan) {
  EXPECT_EQ(complaint(descent.base), "");
  EXPECT_EQ(descent.base.vertex_count(), descent.base_vertices.size());
  EXPECT_TRUE(std::is_sorted(descent.base_vertices.begin(), descent.base_vertices.end()));
  for (const Seed& seed : descent.seeds) EXPECT_NE(descent.base.find_halfedge(seed.s, seed.t), kNone);
  // Every vertex is isolated, of the base, or removed once.
  std::vector<std::uint32_t> all = descent.base_vertices;
  all.insert(all.end(), plan.isolated.begin(), plan.isolated.end());
  for (const PassRecord& pass : descent.passes) all.insert(all.end(), pass.removed.begin(), pass.removed.end());
  std::sort(all.begin(), all.end());
  ASSERT_EQ(all.size(), plan.points.size());
  for (std::uint32_t v = 0; v < all.size(); ++v) ASSERT_EQ(all[v], v);
}

TEST(EncodingPlanTest, EveryVertexOfTheZooIsAccountedFor) {
  for (const auto& [name, mesh] : zoo()) {
    SCOPED_TRACE(name);
    HalfEdgeMesh halfedges;
    const Result<EncodingPlan> plan = make_plan(mesh, 12, halfedges);
    ASSERT_TRUE(plan.ok());
    const Descent whole = stay(halfedges);
    expect_whole(whole, *plan);
    EXPECT_EQ(whole.base.face_count(), mesh.faces.size());
    const std::optional<Descent> descent = descend(std::move(halfedges), *plan, {}, {});
    ASSERT_TRUE(descent);
    expect_whole(*descent, *plan);
    EXPECT_EQ(descent->seeds.size(), whole.seeds.size());
  }
}

// Ears are clipped after the walk that packs the faces: at most theirs lie about at the end.
TEST(EncodingPlanTest, DecimationLeavesNoFacesThatWentLyingAbout) {
  Random random(40);
  TriangleMesh ragged = grid(24, 20, 9);
  flip_edges(ragged, 900, random);
  for (const TriangleMesh& mesh : {sphere(4), ragged, joined(torus(12, 9), ragged)}) {
    HalfEdgeMesh halfedges;
    const Result<EncodingPlan> plan = make_plan(mesh, 12, halfedges);
    ASSERT_TRUE(plan.ok());
    const std::vector<Seed> seeds = choose_seeds(halfedges);
    bool cancelled = false;
    const std::vector<PassRecord> passes = decimate(halfedges, plan->points, seeds, {}, {}, cancelled);
    ASSERT_GT(passes.size(), 4u);
    std::size_t free_slots = 0;
    for (std::uint32_t f = 0; f < halfedges.face_count(); ++f) free_slots += halfedges.is_free_slot(f) ? 1 : 0;
    EXPECT_EQ(free_slots, passes.back().kind == PassKind::ears ? passes.back().removed.size() : 0u);
    EXPECT_LT(halfedges.face_count(), mesh.faces.size() / 3);
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
