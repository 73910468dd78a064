// SPDX-License-Identifier: GPL-3.0-or-later
// What is repaired, what is refused, and what is kept although it looks odd.
#include <gtest/gtest.h>

#include "codec/import/measure.h"
#include "codec/import/write_mesh.h"
#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;

ImportResult<ImportedMesh> through_off(const TriangleMesh& mesh) {
  const auto written = format_mesh(mesh, "off");
  EXPECT_TRUE(written.ok());
  return read_mesh(written->bytes, "off");
}

TriangleMesh with_turned(TriangleMesh mesh, const std::vector<std::size_t>& faces) {
  for (const std::size_t f : faces) std::swap(mesh.faces[f][1], mesh.faces[f][2]);
  return mesh;
}

TEST(Orient, TurnsTheMinorityOfEachComponent) {
  const TriangleMesh original = joined(torus(8, 6), torus(5, 5));
  // Few of the first component, its first face among them; all but few of the second.
  std::vector<std::size_t> turned{0, 4, 50};
  for (std::size_t f = 96; f < original.faces.size(); ++f) {
    if (f != 100 && f != 120) turned.push_back(f);
  }
  const auto mesh = through_off(with_turned(original, turned));
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.faces_turned, 5u);
  EXPECT_EQ(mesh->report.components_with_turned_faces, 2u);
  EXPECT_TRUE(is_valid_cgal(mesh->mesh));
  for (std::size_t f = 0; f < 96; ++f) EXPECT_EQ(mesh->mesh.faces[f], original.faces[f]);
  // The second component was mostly inside out and stays so.
  const Face inside_out{original.faces[110][0], original.faces[110][2], original.faces[110][1]};
  EXPECT_EQ(mesh->mesh.faces[110], inside_out);
}

TEST(Orient, OnATieTheFirstFaceStays) {
  const auto mesh = read_text("OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 2 3\n", "off");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(mesh->report.faces_turned, 1u);
}

TEST(Orient, MoebiusStripIsRefused) {
  std::string text = "OFF\n10 5 0\n";
  for (int i = 0; i < 5; ++i) {
    const double angle = 6.283185307 * i / 5;
    for (const double side : {-0.3, 0.3}) {
      const double r = 1 + side * std::cos(angle / 2);
      text += std::to_string(r * std::cos(angle)) + " " + std::to_string(r * std::sin(angle)) + " " +
              std::to_string(side * std::sin(angle / 2)) + "\n";
    }
  }
  for (const char* quad : {"0 2 3 1", "2 4 5 3", "4 6 7 5", "6 8 9 7", "8 1 0 9"})
    text += std::string("4 ") + quad + "\n";
  const auto mesh = read_text(text, "off");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, not_orientable);
  EXPECT_GE(mesh.error().count, 1u);
  ASSERT_TRUE(mesh.error().line.has_value());
  EXPECT_GE(*mesh.error().line, 13u);
  EXPECT_LE(*mesh.error().line, 17u);
}

TEST(Refuse, RepeatedIndex) {
  const auto mesh = read_text("OFF\n3 3 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 0 1\n3 1 1 1\n", "off");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, repeated_index_in_face);
  EXPECT_EQ(mesh.error().count, 2u);
  EXPECT_EQ(mesh.error().element, 1u);
  EXPECT_EQ(mesh.error().line, 7u);
}

TEST(Refuse, DuplicateFacesInAnyOrder) {
  for (const char* twin : {"3 0 1 2", "3 1 2 0", "3 2 1 0"}) {
    const auto mesh = read_text(std::string("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n") + twin + "\n", "off");
    ASSERT_FALSE(mesh.ok());
    EXPECT_EQ(mesh.error().code, duplicate_face);
    EXPECT_EQ(mesh.error().count, 1u);
    EXPECT_EQ(mesh.error().element, 1u);
    EXPECT_EQ(mesh.error().line, 7u);
  }
}

TEST(Refuse, EdgeWithThreeFaces) {
  const auto mesh = read_text("OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0\n3 0 1 2\n3 1 0 3\n3 0 1 4\n", "off");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, non_manifold_edge);
  EXPECT_EQ(mesh.error().count, 1u);
  EXPECT_EQ(mesh.error().element, 0u);
  EXPECT_EQ(mesh.error().line, 8u);
}

TEST(Refuse, VertexWithTwoFans) {
  const auto bow_tie = read_text("OFF\n5 2 0\n1 0 0\n2 0 0\n0 1 0\n0 0 1\n0 -1 0\n3 1 0 2\n3 2 3 4\n", "off");
  ASSERT_FALSE(bow_tie.ok());
  EXPECT_EQ(bow_tie.error().code, non_manifold_vertex);
  EXPECT_EQ(bow_tie.error().count, 1u);
  EXPECT_EQ(bow_tie.error().element, 2u);
  EXPECT_EQ(bow_tie.error().line, 5u);
  EXPECT_NE(bow_tie.error().message.find("vertex 2"), std::string::npos);
}

TEST(Refuse, AllKindsOfDefectsAreTold) {
  const auto mesh = read_text(
      "OFF\n7 5 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0\n5 5 5\n6 6 6\n3 0 1 2\n3 1 0 3\n3 0 1 4\n3 2 5 6\n3 0 1 2\n",
      "off");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, duplicate_face);
  EXPECT_NE(mesh.error().message.find("1 duplicate face, 1 edge with more than two faces, 1 vertex whose"),
            std::string::npos)
      << mesh.error().message;
}

TEST(Refuse, PolygonsAreNamedAsTheyStandInTheFile) {
  // Face 1 of the file is a polygon; its triangles come later in the mesh than faces count in the file.
  const auto mesh =
      read_text("OFF\n7 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n2 1 0\n3 3 3\n4 0 1 2 3\n4 1 4 5 2\n3 5 2 1\n", "off");
  ASSERT_FALSE(mesh.ok());
  EXPECT_TRUE(mesh.error().code == duplicate_face || mesh.error().code == non_manifold_edge);
  EXPECT_LE(*mesh.error().element, 2u);
}

TEST(Keep, IsolatedVerticesAndFacesOfZeroArea) {
  const auto mesh =
      read_text("OFF\n6 3 0\n0 0 0\n1 0 0\n0 1 0\n9 9 9\n1 0 0\n0.5 0 0\n3 0 1 2\n3 1 4 2\n3 0 5 1\n", "off");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.isolated_vertices, 1u);
  EXPECT_EQ(mesh->report.zero_area_faces, 2u);
  EXPECT_EQ(mesh->mesh.positions.size(), 6u);
  EXPECT_EQ(mesh->mesh.faces.size(), 3u);
}

TEST(ReadMesh, NamesTheFileAndWhatItIsInstead) {
  TemporaryFolder folder;
  const auto missing = read_mesh(folder.file("missing.ply"));
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, cannot_read);
  EXPECT_EQ(missing.error().file, folder.file("missing.ply"));
  EXPECT_NE(to_line(missing.error()).find("No such file"), std::string::npos);
  EXPECT_EQ(read_mesh(folder.file(".")).error().code, cannot_read);

  const auto empty = read_text("", "ply");
  ASSERT_FALSE(empty.ok());
  EXPECT_EQ(empty.error().code, empty_file);
  for (const char* name : {"ply", "off", "obj", "stl", "gz"}) {
    const auto packed = read_text("\x1f\x8b\x08 whatever", name);
    ASSERT_FALSE(packed.ok());
    EXPECT_EQ(packed.error().code, compressed);
    EXPECT_NE(packed.error().message.find("unpack"), std::string::npos);
  }
  EXPECT_EQ(read_text("v 0 0 0\n", "glb").error().code, unknown_extension);
  EXPECT_EQ(read_text("v 0 0 0\n", "").error().code, unknown_extension);
  const auto other = read_text("ply\nformat ascii 1.0\n", "off");
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().code, wrong_format);
  EXPECT_NE(other.error().message.find("looks like a PLY file"), std::string::npos);
}

TEST(ToLine, HasFilePlaceReasonAndCode) {
  ImportError error;
  error.code = malformed;
  error.file = "a.obj";
  error.line = 7;
  error.message = "is wrong";
  EXPECT_EQ(to_line(error), "a.obj:7: is wrong [malformed]");
  error.line.reset();
  error.byte = 12;
  EXPECT_EQ(to_line(error), "a.obj: byte 12: is wrong [malformed]");
  error.byte.reset();
  EXPECT_EQ(to_line(error), "a.obj: is wrong [malformed]");
}

}  // namespace
}  // namespace pmcd::import::testing
