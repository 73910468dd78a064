// SPDX-License-Identifier: MIT
// The base mesh's coder alone: every mesh of the zoo, whole and undecimated, on every coarseness of its cells.
#include "codec/base/base_mesh.h"

#include <gtest/gtest.h>

#include "codec/encoder/plan_writer.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

struct Coded {
  std::vector<std::byte> bytes;
  LevelState written;
  EncodingPlan plan;
  Variant variant;
};

Coded coded(const TriangleMesh& mesh, unsigned bits, unsigned shift) {
  Coded result;
  result.written.lattice = *Lattice::over(mesh, bits);
  result.plan.original = &mesh;
  for (const Position& p : mesh.positions) result.plan.points.push_back(result.written.lattice.snap(p));
  const Descent whole = stay(*HalfEdgeMesh::build(mesh.faces, mesh.positions.size()));
  PlanWriter writer(result.plan, whole, {}, result.variant, result.bytes);
  const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
  const Status status =
      code_base_mesh(result.written, writer, vertices, static_cast<std::uint32_t>(mesh.faces.size()), shift);
  EXPECT_TRUE(status.ok()) << text(status.error());
  writer.finish();
  return result;
}

void expect_read_as_written(const TriangleMesh& mesh, unsigned bits, unsigned shift) {
  const Coded base = coded(mesh, bits, shift);
  LevelState read;
  read.lattice = base.written.lattice;
  PacketReader reader(base.bytes);
  const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
  const Status status = code_base_mesh(read, reader, vertices, static_cast<std::uint32_t>(mesh.faces.size()), shift);
  ASSERT_TRUE(status.ok()) << text(status.error());
  EXPECT_FALSE(reader.failed());
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(complaint(read.mesh), "");
  ASSERT_EQ(read.points, base.written.points);
  ASSERT_EQ(read.mesh.face_count(), mesh.faces.size());
  // The same faces by original number, the same cells, and points in the middle of their cells.
  std::vector<Face> faces;
  for (std::uint32_t f = 0; f < read.mesh.face_count(); ++f) {
    Face face = read.mesh.face(f);
    for (std::uint32_t& v : face) v = base.variant.to_original[v];
    faces.push_back(face);
  }
  EXPECT_EQ(sorted_faces(faces), sorted_faces(mesh.faces));
  for (std::uint32_t v = 0; v < read.points.size(); ++v) {
    const LatticePoint cell = cell_of(base.plan.points[base.variant.to_original[v]], shift);
    ASSERT_EQ(read.points[v], middle_of(cell, shift));
  }
}

TEST(BaseMesh, TheWholeZooComesBackAsItIs) {
  for (const auto& [name, mesh] : zoo()) {
    SCOPED_TRACE(name);
    for (const unsigned bits : {4u, 12u, 24u}) expect_read_as_written(mesh, bits, 0);
  }
}

TEST(BaseMesh, EveryCoarsenessOfCells) {
  Random random(3);
  TriangleMesh mesh = joined(holed_plate(3, 2), grid(12, 9, 3));
  jitter(mesh, 0.05, random);
  for (unsigned shift = 0; shift <= 20; ++shift) {
    SCOPED_TRACE(shift);
    for (const unsigned bits : {4u, 12u, 24u}) expect_read_as_written(mesh, bits, shift);
  }
}

TEST(BaseMesh, RandomMeshesComeBackAsTheyAre) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SCOPED_TRACE(seed);
    expect_read_as_written(any_mesh(seed), 4 + static_cast<unsigned>(seed % 21), static_cast<unsigned>(seed % 5));
  }
}

// Flat, regular, of few different coordinates: a list of them and exact coincidences leave next to nothing to say.
TEST(BaseMesh, MachinePartsCostFewBits) {
  const TriangleMesh plate = holed_plate(16, 4);
  EXPECT_LT(coded(plate, 12, 0).bytes.size() * 8, 5 * plate.positions.size());
}

TEST(BaseMesh, CoarserCellsCostFewerBits) {
  Random random(4);
  TriangleMesh mesh = sphere(2);
  jitter(mesh, 0.05, random);
  std::size_t last = coded(mesh, 16, 0).bytes.size();
  for (const unsigned shift : {2u, 4u, 6u, 8u}) {
    const std::size_t bytes = coded(mesh, 16, shift).bytes.size();
    EXPECT_LT(bytes + mesh.positions.size() / 2, last) << shift;
    last = bytes;
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
