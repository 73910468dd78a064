// SPDX-License-Identifier: GPL-3.0-or-later
// Every mesh of the folder in PMCD_TEST_MESHES: encoded at 12 bits and lossless, decoded level by level, each level
// asked of CGAL, the last one compared with the original file by a comparer in Python that parses the files itself; and
// no fat base where there is no excuse for one. Meshes that do not qualify are refused by name.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <set>
#include <string>

#include "codec/import/compare.h"
#include "codec/import/measure.h"
#include "codec/import/read_mesh.h"
#include "codec/import/write_mesh.h"
#include "codec/proof.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

std::string mesh_folder() {
  const char* const folder = std::getenv("PMCD_TEST_MESHES");
  return folder == nullptr ? "" : folder;
}

struct TemporaryFolder {
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pmcd-corpus-XXXXXX").string();
    const char* const made = mkdtemp(name.data());
    EXPECT_NE(made, nullptr);
    path = made == nullptr ? "" : made;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string path;
};

int run(const std::string& command) {
  return std::system(command.c_str());
}

class Corpus : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (mesh_folder().empty()) GTEST_SKIP() << "PMCD_TEST_MESHES names no folder of meshes";
  }

  /// Where the mesh lies; a packed one is unpacked first.
  std::string path() {
    std::string stored = mesh_folder() + "/" + GetParam();
    if (!std::filesystem::exists(stored + ".gz")) return stored;
    std::string unpacked = folder_.path + "/" + GetParam();
    EXPECT_EQ(run("gzip -dc '" + stored + ".gz' > '" + unpacked + "'"), 0);
    return unpacked;
  }

  TemporaryFolder folder_;
};

// Sum over the components; -1 for a mesh that HalfEdgeMesh refuses.
int genus_of(const TriangleMesh& mesh, std::uint32_t components) {
  const Result<HalfEdgeMesh> links = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  if (!links) return -1;
  int vertices = 0;
  int half_edges = 0;
  int boundary_edges = 0;
  std::map<std::uint32_t, std::uint32_t> next_on_boundary;
  for (std::uint32_t v = 0; v < links->vertex_count(); ++v) vertices += links->outgoing(v) != kNone ? 1 : 0;
  for (std::uint32_t h = 0; h < 3 * links->face_count(); ++h) {
    ++half_edges;
    if (links->opposite(h) != kNone) continue;
    ++boundary_edges;
    next_on_boundary[links->origin(h)] = links->target(h);
  }
  int loops = 0;
  std::set<std::uint32_t> seen;
  for (const auto& [start, unused] : next_on_boundary) {
    if (seen.count(start) != 0) continue;
    ++loops;
    for (std::uint32_t v = start; seen.insert(v).second;) v = next_on_boundary[v];
  }
  const int edges = (half_edges + boundary_edges) / 2;
  const int characteristic = vertices - edges + static_cast<int>(links->face_count());
  return (2 * static_cast<int>(components) - loops - characteristic) / 2;
}

void expect_valid_levels(const Encoded& encoded, const TriangleMesh& mesh, TriangleMesh& last) {
  const Status proven = prove(encoded, mesh, [&](std::size_t k, const Decoder& decoder) {
    const Level level = decoder.level();
    EXPECT_EQ(level.vertices, encoded.packets[k].vertices);
    EXPECT_EQ(level.faces, encoded.packets[k].faces);
    EXPECT_EQ(level.last, k + 1 == encoded.packets.size());
    last = decoder.mesh();
    EXPECT_TRUE(import::is_valid_cgal(last)) << "level " << k;
    if (k > 0) {
      const bool only_exactness = k + 1 == encoded.packets.size() && encoded.report.bits.exactness > 0;
      EXPECT_TRUE(level.vertices > encoded.packets[k - 1].vertices || only_exactness) << "level " << k;
    }
    return true;
  });
  EXPECT_TRUE(proven.ok()) << text(proven.error());
}

void expect_slim(const Encoded& encoded, const TriangleMesh& mesh, bool at_12_bits) {
  const int genus = genus_of(mesh, encoded.report.components);
  if (mesh.positions.size() <= 5000 || genus >= 5 || encoded.report.components >= 10) return;
  EXPECT_LE(encoded.packets[0].vertices, 100u);
  if (at_12_bits) {
    EXPECT_LE(encoded.packets[0].bytes.size(), 600u);
  }
  EXPECT_GE(encoded.packets.size(), 8u);
  for (std::size_t k = 1; k < encoded.packets.size(); ++k) {
    // Isolated vertices come with the last of the refinements; they are no part of how a level grows.
    const bool may_bring_isolated = encoded.packets[k].vertices == mesh.positions.size();
    const std::uint32_t isolated = may_bring_isolated ? encoded.report.isolated_vertices : 0;
    EXPECT_LE(encoded.packets[k].vertices - isolated, 3 * encoded.packets[k - 1].vertices) << "level " << k;
  }
}

class Accepted : public Corpus {};
class Refused : public Corpus {};

TEST_P(Accepted, LosslessIsTheOriginalFile) {
  const std::string original = path();
  const auto imported = import::read_mesh(original);
  ASSERT_TRUE(imported.ok()) << import::to_line(imported.error());
  const Result<Encoded> encoded = encode(imported->mesh, {});
  ASSERT_TRUE(encoded.ok()) << text(encoded.error());
  TriangleMesh last;
  expect_valid_levels(*encoded, imported->mesh, last);
  expect_slim(*encoded, imported->mesh, false);

  const std::string decoded = folder_.path + "/decoded.ply";
  ASSERT_TRUE(import::write_mesh(decoded, last).ok());
  // The file itself is what to compare with, unless import had to change the faces.
  std::string wanted = original;
  std::string flags;
  if (imported->report.polygons_triangulated > 0) {
    wanted = folder_.path + "/triangulated.ply";
    ASSERT_TRUE(import::write_mesh(wanted, imported->mesh).ok());
  } else if (imported->report.faces_turned > 0) {
    flags = " --any-orientation";
    EXPECT_TRUE(import::compare_meshes(imported->mesh, last).same);
  }
  EXPECT_EQ(run("'" PMCD_PYTHON "' '" PMCD_COMPARE_MESHES "'" + flags + " '" + wanted + "' '" + decoded + "'"), 0);
}

TEST_P(Accepted, TwelveBitsAreTheSnappedOriginal) {
  const auto imported = import::read_mesh(path());
  ASSERT_TRUE(imported.ok()) << import::to_line(imported.error());
  EncodeOptions options;
  options.bits = 12;
  const Result<Encoded> encoded = encode(imported->mesh, options);
  ASSERT_TRUE(encoded.ok()) << text(encoded.error());
  TriangleMesh last;
  expect_valid_levels(*encoded, imported->mesh, last);
  expect_slim(*encoded, imported->mesh, true);
  EXPECT_EQ(difference(snapped(imported->mesh, 12), last), "");
}

TEST_P(Refused, ByName) {
  static const std::map<std::string, import::ImportErrorCode> reasons = {
      {"conrod.stl", import::ImportErrorCode::duplicate_face},
      {"deg_faces.obj", import::ImportErrorCode::repeated_index_in_face},
      {"dragon_vrip_res3.ply", import::ImportErrorCode::duplicate_face},
      {"hourglass_ico.obj", import::ImportErrorCode::non_manifold_vertex},
      {"moebius.obj", import::ImportErrorCode::not_orientable},
  };
  const auto imported = import::read_mesh(path());
  ASSERT_FALSE(imported.ok());
  EXPECT_STREQ(import::error_name(imported.error().code), import::error_name(reasons.at(GetParam())));
}

std::string test_name(const ::testing::TestParamInfo<const char*>& tested) {
  std::string name = tested.param;
  name.resize(name.find('.'));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Meshes, Accepted,
                         ::testing::Values("1002_tray_bottom.STL", "Laurana50k.ply", "armadillo.off",
                                           "blobby-shuffled.off", "bones.off", "bun_zipper.ply", "bunny00.off",
                                           "colored_tetra.ply", "dino.off", "diplodocus.off", "dragon_vrip.ply",
                                           "fandisk.off", "femur.off", "fertility.off", "horse.ply", "mountain.obj",
                                           "nefertiti.obj", "octahedron.off", "rocker-arm.obj", "screwdriver.ply",
                                           "soup.stl", "spot.obj", "sword-quad-dominant.obj", "triangle.off",
                                           "venus-original.off"),
                         test_name);
INSTANTIATE_TEST_SUITE_P(Meshes, Refused,
                         ::testing::Values("conrod.stl", "deg_faces.obj", "dragon_vrip_res3.ply", "hourglass_ico.obj",
                                           "moebius.obj"),
                         test_name);

}  // namespace
}  // namespace pmcd::codec::testing
