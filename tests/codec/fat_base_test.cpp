// SPDX-License-Identifier: MIT
// No way out into a fat base: meshes of over 5,000 vertices, genus under 5 and fewer than 10 components start with at
// most 100 vertices and 600 bytes at 12 bits, have 8 packets or more, and no level is over 3 times the one before.
#include <gtest/gtest.h>

#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

TriangleMesh changed(TriangleMesh mesh, double noise, std::uint32_t splits, std::uint32_t flips) {
  Random random(2);
  split_faces(mesh, splits, random);
  flip_edges(mesh, flips, random);
  if (noise > 0) jitter(mesh, noise, random);
  return renumbered(mesh, random);
}

TriangleMesh side_by_side(unsigned count, unsigned levels) {
  TriangleMesh mesh;
  for (unsigned i = 0; i < count; ++i) {
    TriangleMesh one = sphere(levels);
    for (Position& p : one.positions) p[0] = static_cast<double>(static_cast<float>(p[0] + 3.0 * i));
    mesh = joined(mesh, one);
  }
  return mesh;
}

struct Case {
  const char* name;
  TriangleMesh (*make)();
};

class FatBase : public ::testing::TestWithParam<Case> {};

void expect_slim(const TriangleMesh& mesh, const EncodeOptions& options) {
  ASSERT_GT(mesh.positions.size(), 5000u);
  Encoded encoded;
  ASSERT_EQ(round_trip(mesh, options, &encoded), "");
  ASSERT_LT(encoded.report.components, 10u);
  EXPECT_LE(encoded.packets[0].vertices, 100u);
  if (options.bits == 12u) {
    EXPECT_LE(encoded.packets[0].bytes.size(), 600u);
  }
  EXPECT_GE(encoded.packets.size(), 8u);
  for (std::size_t k = 1; k < encoded.packets.size(); ++k) {
    EXPECT_LE(encoded.packets[k].vertices, 3 * encoded.packets[k - 1].vertices) << "level " << k;
  }
}

TEST_P(FatBase, SmallBaseAndManyLevels) {
  EncodeOptions options;
  options.bits = 12;
  expect_slim(GetParam().make(), options);
}

// Sixty handles keep hundreds of vertices in the base mesh; coded in one go the plate is a fraction of its levels.
TEST(FatBaseOfManyHandles, IsOnePacketWhenThatIsMuchSmaller) {
  const TriangleMesh plate = holed_plate(60, 3);
  EncodeOptions options;
  options.bits = 12;
  Encoded encoded;
  ASSERT_EQ(round_trip(plate, options, &encoded), "");
  EXPECT_EQ(encoded.packets.size(), 1u);
  EXPECT_LT(encoded.packets[0].bytes.size() * 8, 6 * plate.positions.size());
}

TEST_P(FatBase, LosslessToo) {
  expect_slim(GetParam().make(), {});
}

INSTANTIATE_TEST_SUITE_P(
    Generated, FatBase,
    ::testing::Values(
        Case{"sphere", [] { return sphere(6); }}, Case{"noise", [] { return changed(sphere(6), 0.02, 0, 0); }},
        Case{"rough", [] { return changed(sphere(6), 0.5, 0, 0); }},
        Case{"uv_sphere", [] { return uv_sphere(75, 75); }},
        Case{"stellar", [] { return changed(sphere(3), 0.001, 8000, 0); }},
        Case{"apollonian", [] { return changed(tetrahedron(), 0, 6000, 0); }},
        Case{"flipped", [] { return changed(sphere(6), 0, 0, 100000); }}, Case{"torus", [] { return torus(100, 60); }},
        Case{"genus_2", [] { return holed_plate(2, 14); }},
        Case{"genus_4", [] { return changed(holed_plate(4, 11), 0.01, 0, 0); }},
        Case{"grid", [] { return grid(75, 75, 0); }},
        Case{"grid_with_holes", [] { return changed(grid(75, 75, 4), 0, 0, 4000); }},
        Case{"mixed_grid", [] { return changed(grid(60, 60, 2), 0.001, 4000, 10000); }},
        Case{"long_grid", [] { return grid(400, 16, 0); }}, Case{"three_cells_wide", [] { return grid(2000, 3, 0); }},
        Case{"two_cells_wide", [] { return grid(2500, 2, 0); }}, Case{"strip", [] { return grid(3000, 1, 0); }},
        Case{"ragged_holes", [] { return changed(grid(80, 80, 10), 0, 0, 30000); }},
        Case{"cone", [] { return cone(6000); }}, Case{"bipyramid", [] { return bipyramid(6000); }},
        Case{"nine_components", [] { return side_by_side(9, 4); }},
        Case{"unequal_components", [] { return joined(joined(sphere(6), scaled(torus(9, 9), 0.01)), tetrahedron()); }},
        Case{"flat",
             [] {
               TriangleMesh mesh = grid(80, 70, 0);
               for (Position& p : mesh.positions) p[2] = 0;
               return mesh;
             }},
        Case{"in_one_point",
             [] {
               TriangleMesh mesh = sphere(6);
               mesh.positions.assign(mesh.positions.size(), {1, 2, 3});
               return mesh;
             }}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace pmcd::codec::testing
