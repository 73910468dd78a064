// SPDX-License-Identifier: MIT
// Growing precision: how the encoder chooses it, and what it promises from the first level to the last.
#include "codec/encoder/precision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codec/packet/header.h"
#include "tests/codec/generated.h"
#include "tests/codec/levels.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

std::vector<LatticePoint> points_of(const TriangleMesh& mesh, unsigned bits) {
  const Result<Lattice> lattice = Lattice::over(mesh, bits);
  EXPECT_TRUE(lattice.ok());
  std::vector<LatticePoint> points;
  for (const Position& p : mesh.positions) points.push_back(lattice->snap(p));
  return points;
}

TriangleMesh bumpy_sphere(unsigned levels) {
  Random random(7);
  TriangleMesh mesh = sphere(levels);
  jitter(mesh, 0.003, random);
  return mesh;
}

TEST(PrecisionPlanTest, NeverMoreDigitsMissingWithMoreVertices) {
  const TriangleMesh mesh = bumpy_sphere(5);
  const auto total = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned bits = kMinLatticeBits; bits <= kMaxLatticeBits; ++bits) {
    const PrecisionPlan plan(mesh, points_of(mesh, bits), Alignment::none);
    unsigned before = bits;
    for (std::uint32_t vertices = 0; vertices <= total; vertices += 1 + vertices / 50) {
      const unsigned shift = plan.shift_at(vertices, bits);
      ASSERT_LE(shift, before) << bits << " bits, " << vertices << " vertices";
      ASSERT_LE(shift + 4, bits);
      before = shift;
    }
    EXPECT_LE(plan.shift_at(total, bits), before);
  }
}

TEST(PrecisionPlanTest, WholeMeshHasAllDigitsCoarseOnesDoNot) {
  const TriangleMesh mesh = bumpy_sphere(5);
  const auto total = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned bits : {8u, 12u, 14u}) {
    const PrecisionPlan plan(mesh, points_of(mesh, bits), Alignment::none);
    EXPECT_EQ(plan.shift_at(total, bits), 0u) << bits;
  }
  // A sphere as wide as the lattice: of 20 vertices its edges are 6980 steps long, a twelfth of that holds 2^9; of 200
  // they are 2200 long.
  const PrecisionPlan plan(mesh, points_of(mesh, 14), Alignment::none);
  EXPECT_EQ(plan.shift_at(20, 14), 9u);
  EXPECT_EQ(plan.shift_at(95, 14), 8u);   // 3200
  EXPECT_EQ(plan.shift_at(112, 14), 7u);  // 2950, less than 12 * 2^8
  EXPECT_EQ(plan.shift_at(200, 14), 7u);
}

// Cells are a fixed fraction of the edge among coarse levels: four times the vertices, one digit more.
TEST(PrecisionPlanTest, CellsFollowTheEdges) {
  const TriangleMesh mesh = bumpy_sphere(6);
  const PrecisionPlan plan(mesh, points_of(mesh, 24), Alignment::none);
  for (std::uint32_t vertices : {16u, 20u, 50u, 64u}) {
    EXPECT_EQ(plan.shift_at(vertices, 24), plan.shift_at(4 * vertices, 24) + 1);
    EXPECT_EQ(plan.shift_at(vertices, 24), plan.shift_at(16 * vertices, 24) + 2);
  }
}

TEST(PrecisionPlanTest, PlanesKeepTheWholeLattice) {
  const TriangleMesh mesh = bumpy_sphere(4);
  const PrecisionPlan plan(mesh, points_of(mesh, 14), Alignment::planes);
  const PrecisionPlan some(mesh, points_of(mesh, 14), Alignment::some);
  const PrecisionPlan none(mesh, points_of(mesh, 14), Alignment::none);
  for (std::uint32_t vertices : {0u, 1u, 10u, 100u, 1000u}) {
    EXPECT_EQ(plan.shift_at(vertices, 14), 0u);
    EXPECT_EQ(some.shift_at(vertices, 14), none.shift_at(vertices, 14));
  }
}

TEST(PrecisionPlanTest, NoAreaAndNoVerticesAreFine) {
  for (unsigned bits : {4u, 24u}) {
    EXPECT_EQ(PrecisionPlan({}, {}, Alignment::none).shift_at(0, bits), 0u);
    const TriangleMesh mesh = single_triangle();
    const std::vector<LatticePoint> one(3, LatticePoint{7, 7, 7});
    EXPECT_EQ(PrecisionPlan(mesh, one, Alignment::none).shift_at(3, bits), 0u);
  }
}

TEST(AlignmentTest, BoxesLieInPlanes) {
  for (unsigned bits : {8u, 12u, 16u}) {
    const TriangleMesh box = holed_plate(1, 4);
    EXPECT_EQ(alignment_of(box, points_of(box, bits)), Alignment::planes) << bits;
  }
}

TEST(AlignmentTest, NoisySpheresHaveNone) {
  for (unsigned bits : {10u, 12u, 14u, 20u}) {
    TriangleMesh mesh = bumpy_sphere(5);
    EXPECT_EQ(alignment_of(mesh, points_of(mesh, bits)), Alignment::none) << bits;
  }
}

TEST(AlignmentTest, HalfwayIsSome) {
  // Points at random, but every so many edges along a plane.
  Random random(4);
  TriangleMesh mesh = sphere(4);
  std::vector<LatticePoint> points(mesh.positions.size());
  for (LatticePoint& p : points) p = {0, 0, 0};
  for (std::size_t v = 0; v < points.size(); ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) points[v][axis] = static_cast<std::int32_t>(random.below(5));
  }
  // Of 25 pairs 5 are equal and 8 one apart: more equal than chance has it on a fine lattice, not twice as many.
  EXPECT_EQ(alignment_of(mesh, points), Alignment::some);
  // A handful of edges says nothing.
  EXPECT_EQ(alignment_of(octahedron(), std::vector<LatticePoint>(6)), Alignment::none);
}

struct Stream {
  Encoded encoded;
  std::vector<LevelState> levels;
};

Stream stream_of(const TriangleMesh& mesh, std::optional<unsigned> bits) {
  EncodeOptions options;
  options.bits = bits;
  Stream stream{encoded_mesh(mesh, options), {}};
  stream.levels = levels_of(stream.encoded);
  return stream;
}

// Lattice points by decoder vertex, from the last level, which must have all digits.
std::vector<LatticePoint> final_points(const LevelState& last) {
  EXPECT_EQ(last.shift, 0u);
  std::vector<LatticePoint> all;
  for (const LatticePoint& middle : last.points) {
    for (std::int32_t c : middle) EXPECT_EQ(c % 2, 0);
    all.push_back(cell_of_middle(middle, 0));
  }
  return all;
}

void expect_growing_precision(const TriangleMesh& mesh, std::optional<unsigned> bits) {
  const Stream stream = stream_of(mesh, bits);
  ASSERT_EQ(stream.levels.size(), stream.encoded.packets.size());
  ASSERT_GE(stream.levels.size(), 4u);
  const LevelState& last = stream.levels.back();
  const std::vector<LatticePoint> truth = final_points(last);
  std::vector<LatticePoint> sorted = truth;
  std::vector<LatticePoint> original = points_of(mesh, last.lattice.bits);
  std::sort(sorted.begin(), sorted.end());
  std::sort(original.begin(), original.end());
  EXPECT_EQ(sorted, original);

  for (std::size_t k = 0; k < stream.levels.size(); ++k) {
    const LevelState& level = stream.levels[k];
    const std::int32_t half = (1 << level.shift) - 1;  // half steps from a cell's middle to its outermost points
    for (std::size_t v = 0; v < level.points.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_LE(std::abs(level.points[v][axis] - 2 * truth[v][axis]), half) << "level " << k << ", vertex " << v;
      }
      if (level.mesh.outgoing(static_cast<std::uint32_t>(v)) == kNone) continue;
      ASSERT_EQ(level.points[v], middle_of(cell_of(truth[v], level.shift), level.shift)) << "level " << k;
    }
    if (k == 0) continue;
    const LevelState& before = stream.levels[k - 1];
    ASSERT_LE(level.shift, before.shift);
    for (std::size_t v = 0; v < before.points.size(); ++v) {
      if (before.mesh.outgoing(static_cast<std::uint32_t>(v)) == kNone) continue;
      ASSERT_EQ(cell_of_middle(level.points[v], before.shift), cell_of_middle(before.points[v], before.shift))
          << "level " << k << " moves vertex " << v << " out of its cell";
    }
  }
  EXPECT_GT(stream.levels.front().shift, 2u) << "the first level would be as fine as the last";
}

TEST(GrowingPrecision, EveryLevelIsTheMeshInItsCells) {
  // No mirror image of itself: such a mesh has all digits from the start.
  TriangleMesh mesh = bumpy_sphere(5);
  Random random(10);
  jitter(mesh, 0.01, random);
  for (unsigned bits : {10u, 14u, 20u}) expect_growing_precision(mesh, bits);
}

TEST(GrowingPrecision, AMirrorImageOfItselfHasAllDigitsFromTheStart) {
  const Stream stream = stream_of(uv_sphere(24, 32), 10);
  ASSERT_GT(stream.levels.size(), 2u);
  for (const LevelState& level : stream.levels) EXPECT_EQ(level.shift, 0u);
  EXPECT_TRUE(stream.levels.front().models.position.repetition.reflection.any());
}

TEST(GrowingPrecision, LosslessToo) {
  expect_growing_precision(bumpy_sphere(5), std::nullopt);
}

TEST(GrowingPrecision, WithIsolatedVerticesAndBorders) {
  Random random(9);
  TriangleMesh mesh = joined(bumpy_sphere(4), grid(20, 20, 3));
  jitter(mesh, 0.003, random);
  add_isolated(mesh, 30, random);
  expect_growing_precision(mesh, 14);
  expect_growing_precision(mesh, std::nullopt);
}

TEST(GrowingPrecision, LastLevelIsExact) {
  const TriangleMesh mesh = bumpy_sphere(5);
  for (std::optional<unsigned> bits : {std::optional<unsigned>(14), std::optional<unsigned>()}) {
    const Stream stream = stream_of(mesh, bits);
    ASSERT_FALSE(stream.levels.empty());
    EXPECT_EQ(difference(bits ? snapped(mesh, *bits) : mesh, to_triangle_mesh(stream.levels.back())), "");
    // Only the last of a lossless mesh has exact coordinates.
    for (std::size_t k = 0; k + 1 < stream.levels.size(); ++k) EXPECT_TRUE(stream.levels[k].exact.empty());
    EXPECT_EQ(stream.levels.back().exact.size(), bits ? 0 : mesh.positions.size());
  }
}

TEST(GrowingPrecision, EveryLevelHasTheHashOfItsHeader) {
  for (std::optional<unsigned> bits : {std::optional<unsigned>(14), std::optional<unsigned>()}) {
    const Stream stream = stream_of(bumpy_sphere(4), bits);
    ASSERT_EQ(stream.levels.size(), stream.encoded.packets.size());
    for (std::size_t k = 0; k < stream.levels.size(); ++k) {
      const Result<PacketHeader> header = parse_packet_header(stream.encoded.packets[k].bytes);
      ASSERT_TRUE(header.ok());
      const std::uint64_t hash = mesh_hash(stream.levels[k]);
      EXPECT_TRUE(header->proves(hash)) << k;
      EXPECT_FALSE(header->proves(hash ^ 1)) << k;
      if (header->last) {
        EXPECT_EQ(header->mesh_hash, hash);
      }
      LevelState moved = stream.levels[k];
      moved.points[0][1] += 2;
      EXPECT_FALSE(header->proves(mesh_hash(moved))) << k;
    }
  }
}

// A packet adds eight digits at most: few packets for many digits keep earlier levels from leaving out more.
TEST(GrowingPrecision, FewPacketsCanAddManyDigits) {
  for (const TriangleMesh& mesh : {sphere(0), sphere(1), bumpy_sphere(3), grid(5, 5, 0), single_triangle()}) {
    for (unsigned bits : {16u, 20u, 24u}) {
      for (unsigned most : {1u, 2u, 1000u}) {
        EncodeOptions options;
        options.bits = bits;
        options.max_packets_after_base = most;
        EXPECT_EQ(round_trip(mesh, options), "") << bits << " bits, " << most << " packets";
      }
    }
  }
}

TEST(GrowingPrecision, BoxesAreOnTheirLatticeFromTheStart) {
  Random random(10);
  const TriangleMesh box = holed_plate(4, 4);
  for (const LevelState& level : stream_of(box, 14).levels) EXPECT_EQ(level.shift, 0u);
}

TEST(GrowingPrecision, CoarseLevelsCostLess) {
  // The encoder's account knows of the digits that came later; and without them the first packets are smaller than with
  // the whole lattice from the start.
  const Stream stream = stream_of(bumpy_sphere(5), 14);
  EXPECT_GT(stream.encoded.report.bits.precision, 1000);
  const auto vertices = stream.levels.front().points.size();
  EXPECT_LT(stream.encoded.report.bits.base, 3.0 * 14 * static_cast<double>(vertices));
}

}  // namespace
}  // namespace pmcd::codec::testing
