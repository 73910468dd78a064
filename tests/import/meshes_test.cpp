// SPDX-License-Identifier: GPL-3.0-or-later
// Every mesh of the folder in PMCD_TEST_MESHES against what is known of it: counts, repairs, or the reason of refusal.
#include <gtest/gtest.h>

#include <cstdio>

#include "codec/import/compare.h"
#include "codec/import/file_io.h"
#include "codec/import/measure.h"
#include "codec/import/write_mesh.h"
#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;

struct Expected {
  std::string file;
  std::uint64_t vertices = 0;
  std::uint64_t faces = 0;
  std::uint64_t isolated = 0;
  std::uint64_t welded = 0;
  std::uint64_t turned = 0;
  std::uint64_t zero_area = 0;
  std::size_t left_out = 0;
  ImportErrorCode code = malformed;
  std::uint64_t count = 0;
  friend std::ostream& operator<<(std::ostream& out, const Expected& expected) { return out << expected.file; }
};

class Meshes : public ::testing::TestWithParam<Expected> {
 protected:
  void SetUp() override {
    if (!mesh_folder()) GTEST_SKIP() << "PMCD_TEST_MESHES names no folder of meshes";
  }

  /// The file's path; a packed one is unpacked into the temporary folder first.
  std::string path() {
    std::string stored = *mesh_folder() + "/" + GetParam().file;
    if (std::filesystem::exists(stored)) return stored;
    std::string unpacked = folder_.file(GetParam().file);
    const std::string command = "gzip -dc '" + stored + ".gz' > '" + unpacked + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << stored;
    return unpacked;
  }

  TemporaryFolder folder_;
};

class Accepted : public Meshes {};
class Refused : public Meshes {};

TEST_P(Refused, ByNameWithCountAndPlace) {
  const auto mesh = read_mesh(path());
  ASSERT_FALSE(mesh.ok());
  EXPECT_STREQ(error_name(mesh.error().code), error_name(GetParam().code)) << to_line(mesh.error());
  EXPECT_EQ(mesh.error().count, GetParam().count);
  EXPECT_TRUE(mesh.error().line.has_value() || mesh.error().byte.has_value());
  EXPECT_TRUE(mesh.error().element.has_value());
}

TEST_P(Accepted, WithCountsAndRepairsAsKnown) {
  const Expected& expected = GetParam();
  const auto mesh = read_mesh(path());
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  const ImportReport& report = mesh->report;
  EXPECT_EQ(report.vertices, expected.vertices);
  EXPECT_EQ(report.faces, expected.faces);
  EXPECT_EQ(report.isolated_vertices, expected.isolated);
  EXPECT_EQ(report.corners_welded, expected.welded);
  EXPECT_EQ(report.faces_turned, expected.turned);
  EXPECT_EQ(report.zero_area_faces, expected.zero_area);
  EXPECT_EQ(report.left_out.size(), expected.left_out);
  EXPECT_EQ(report.polygons_not_simple, 0u);
  EXPECT_TRUE(is_valid_cgal(mesh->mesh));
  const auto strict = read_mesh(path(), {.strict = true, .as_double = false});
  EXPECT_EQ(strict.ok(), expected.left_out == 0);
}

TEST_P(Accepted, SameInOtherNumbersAndAfterWriting) {
  const auto mesh = read_mesh(path());
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  const TriangleMesh other = renumbered(mesh->mesh, 42);
  EXPECT_TRUE(compare_meshes(mesh->mesh, other).same);
  for (const std::string extension : {"ply", "obj", "off"}) {
    const auto written = format_mesh(other, extension);
    ASSERT_TRUE(written.ok());
    const auto back =
        read_mesh(written->bytes, extension, {.strict = true, .as_double = mesh->mesh.scalar == Scalar::float64});
    ASSERT_TRUE(back.ok()) << to_line(back.error());
    EXPECT_EQ(back->report.faces_turned, 0u);
    EXPECT_TRUE(compare_meshes(mesh->mesh, back->mesh).same) << extension;
  }
  TriangleMesh turned = other;
  std::swap(turned.faces[turned.faces.size() / 2][0], turned.faces[turned.faces.size() / 2][1]);
  EXPECT_FALSE(compare_meshes(mesh->mesh, turned).same);
  EXPECT_EQ(ErrorMeter(mesh->mesh).distance_to(other).max, 0);
}

std::string test_name(const ::testing::TestParamInfo<Expected>& tested) {
  std::string name = tested.param.file.substr(0, tested.param.file.find('.'));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(
    Known, Accepted,
    ::testing::Values(
        Expected{.file = "1002_tray_bottom.STL", .vertices = 2216, .faces = 4520, .welded = 11344, .left_out = 1},
        Expected{.file = "Laurana50k.ply", .vertices = 27861, .faces = 49954, .isolated = 2735, .left_out = 1},
        Expected{.file = "armadillo.off", .vertices = 26002, .faces = 52000},
        Expected{.file = "blobby-shuffled.off", .vertices = 2027, .faces = 4050, .turned = 2017},
        Expected{.file = "bones.off", .vertices = 2154, .faces = 4204},
        Expected{.file = "bun_zipper.ply", .vertices = 35947, .faces = 69451, .isolated = 1113, .left_out = 1},
        Expected{.file = "bunny00.off", .vertices = 37706, .faces = 75408},
        Expected{.file = "colored_tetra.ply", .vertices = 4, .faces = 4, .left_out = 6},
        Expected{.file = "dino.off", .vertices = 3916, .faces = 7828, .left_out = 1},
        Expected{.file = "diplodocus.off", .vertices = 23982, .faces = 47960},
        Expected{.file = "dragon_vrip.ply", .vertices = 437645, .faces = 871414, .zero_area = 108},
        Expected{.file = "fandisk.off", .vertices = 6475, .faces = 12946},
        Expected{.file = "femur.off", .vertices = 3897, .faces = 7798},
        Expected{.file = "fertility.off", .vertices = 4494, .faces = 9000},
        Expected{.file = "horse.ply", .vertices = 48485, .faces = 96966, .left_out = 1},
        Expected{.file = "mountain.obj", .vertices = 25600, .faces = 50562, .left_out = 1},
        Expected{.file = "nefertiti.obj", .vertices = 49971, .faces = 99938},
        Expected{.file = "octahedron.off", .vertices = 6, .faces = 8},
        Expected{.file = "rocker-arm.obj", .vertices = 10044, .faces = 20088},
        Expected{.file = "screwdriver.ply", .vertices = 6789, .faces = 13574, .left_out = 1},
        Expected{.file = "soup.stl", .vertices = 300, .faces = 100, .left_out = 1},
        Expected{.file = "spot.obj", .vertices = 2930, .faces = 5856, .left_out = 1},
        Expected{.file = "sword-quad-dominant.obj", .vertices = 22293, .faces = 44582},
        Expected{.file = "triangle.off", .vertices = 3, .faces = 1},
        Expected{.file = "venus-original.off", .vertices = 50002, .faces = 100000}),
    test_name);
INSTANTIATE_TEST_SUITE_P(
    Known, Refused,
    ::testing::Values(Expected{.file = "conrod.stl", .code = duplicate_face, .count = 3},
                      Expected{.file = "deg_faces.obj", .code = repeated_index_in_face, .count = 1},
                      Expected{.file = "dragon_vrip_res3.ply", .code = duplicate_face, .count = 1254},
                      Expected{.file = "hourglass_ico.obj", .code = non_manifold_vertex, .count = 1},
                      Expected{.file = "moebius.obj", .code = not_orientable, .count = 4}),
    test_name);

TEST(MeshFolder, PackedMeshSaysSo) {
  if (!mesh_folder()) GTEST_SKIP() << "PMCD_TEST_MESHES names no folder of meshes";
  const auto mesh = read_mesh(*mesh_folder() + "/dragon_vrip.ply.gz");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, compressed);
  EXPECT_NE(to_line(mesh.error()).find("dragon_vrip.ply.gz: is compressed with gzip; unpack it first"),
            std::string::npos);
}

TEST(MeshFolder, DiplodocusNeedsItsCoincidentVertices) {
  if (!mesh_folder()) GTEST_SKIP() << "PMCD_TEST_MESHES names no folder of meshes";
  const auto mesh = read_mesh(*mesh_folder() + "/diplodocus.off");
  ASSERT_TRUE(mesh.ok());
  // Exchange the coincident vertices in one face: the same triples of positions, yet another mesh.
  TriangleMesh other = mesh->mesh;
  std::vector<std::uint32_t> order(other.positions.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](auto x, auto y) { return other.positions[x] < other.positions[y]; });
  const auto twin = std::adjacent_find(order.begin(), order.end(),
                                       [&](auto x, auto y) { return other.positions[x] == other.positions[y]; });
  ASSERT_NE(twin, order.end());
  for (Face& face : other.faces) {
    const auto corner = std::find(face.begin(), face.end(), *twin);
    if (corner == face.end()) continue;
    *corner = *(twin + 1);
    break;
  }
  const Comparison comparison = compare_meshes(mesh->mesh, other);
  EXPECT_FALSE(comparison.same);
  ASSERT_EQ(comparison.differences.size(), 1u);
  EXPECT_NE(comparison.differences[0].find("connected differently"), std::string::npos);
}

}  // namespace
}  // namespace pmcd::import::testing
