// SPDX-License-Identifier: GPL-3.0-or-later
// OBJ statements that are read, left out and refused.
#include <gtest/gtest.h>

#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;

constexpr std::string_view kFour = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

TEST(Obj, ReadsEveryFormOfACorner) {
  const auto mesh = read_text(
      std::string(kFour) + "vt 0 0\nvn 0 0 1\nf 1 3 2\nf 1/1 2/1 4/1\nf 2//1 3//1 4//1\nf 1/1/1 4/1/1 3/1/1\n", "obj");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}));
  EXPECT_EQ(mesh->report.left_out,
            (std::vector<std::string>{"texture coordinates (vt), 1 line", "normals (vn), 1 line"}));
}

TEST(Obj, NegativeIndicesCountBackFromWhereTheyStand) {
  const auto mesh = read_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -4 -1 -3\n", "obj");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}, {0, 3, 1}}));
}

TEST(Obj, PositiveIndicesMayNameLaterVertices) {
  const auto mesh = read_text("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n", "obj");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}}));
}

TEST(Obj, CommentsContinuationsAndLineEnds) {
  constexpr std::string_view kText =
      "# a comment\nv 0 0 \\\n0 # here too\n\tv +1 0 0\n\nv 0 1e0 0\nf 1 \\\n 2 \\\n 3\n";
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string text;
    for (const char c : kText) c == '\n' ? text.append(end) : text.append(1, c);
    const auto mesh = read_text(text, "obj");
    ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
    EXPECT_EQ(mesh->mesh.positions, (std::vector<Position>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh->mesh.faces.size(), 1u);
  }
}

TEST(Obj, ErrorBehindAContinuationNamesTheLineOfItsStatement) {
  const auto mesh = read_text("v 0 0 0\nv 1 \\\n0 \\\n0\nf 1 \\\n2\n", "obj");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, too_few_corners);
  EXPECT_EQ(mesh.error().line, 5u);
}

TEST(Obj, LeavesOutByName) {
  const auto mesh = read_text("mtllib a.mtl\no thing\ng part\nusemtl red\ns off\n" + std::string(kFour) +
                                  "v 0 0 2 1 0 0\nl 1 2\ns 1\ncurv2 1\nf 1 2 3\n",
                              "obj");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.left_out,
            (std::vector<std::string>{
                "weights or colours behind the coordinates of 1 vertices", "material libraries (mtllib), 1 line",
                "object names (o), 1 line", "groups (g), 1 line", "uses of materials (usemtl), 1 line",
                "smoothing groups (s), 2 lines", "line elements (l), 1 line", "statements 'curv2', 1 line"}));
  EXPECT_EQ(mesh->report.isolated_vertices, 2u);
}

struct BrokenObj {
  const char* name;
  std::string tail;  ///< behind kFour
  ImportErrorCode code;
  std::uint64_t line;
  friend std::ostream& operator<<(std::ostream& out, const BrokenObj& broken) { return out << broken.name; }
};

class ObjBroken : public ::testing::TestWithParam<BrokenObj> {};

TEST_P(ObjBroken, IsRefusedByNameAndLine) {
  const auto mesh = read_text(std::string(kFour) + GetParam().tail, "obj");
  ASSERT_FALSE(mesh.ok());
  EXPECT_STREQ(error_name(mesh.error().code), error_name(GetParam().code)) << to_line(mesh.error());
  EXPECT_EQ(mesh.error().line, GetParam().line) << to_line(mesh.error());
}

INSTANTIATE_TEST_SUITE_P(Obj, ObjBroken,
                         ::testing::Values(BrokenObj{"Zero", "f 1 2 0\n", index_out_of_range, 5},
                                           BrokenObj{"TooLarge", "\nf 1 2 5\n", index_out_of_range, 6},
                                           BrokenObj{"TooFarBack", "f 1 2 -5\n", index_out_of_range, 5},
                                           BrokenObj{"Beyond64Bits", "f 1 2 99999999999999999999\n", malformed, 5},
                                           BrokenObj{"Beyond32Bits", "f 1 2 4294967297\n", index_out_of_range, 5},
                                           BrokenObj{"Corner", "f 1 2 3/a\n", malformed, 5},
                                           BrokenObj{"CornerText", "f 1 2 x\n", malformed, 5},
                                           BrokenObj{"TwoCorners", "f 1 2\n", too_few_corners, 5},
                                           BrokenObj{"TwoCoordinates", "v 1 2\n", malformed, 5},
                                           BrokenObj{"Coordinate", "v 1 2 3..4\n", malformed, 5},
                                           BrokenObj{"Nan", "v 1 2 NaN\n", non_finite_coordinate, 5},
                                           BrokenObj{"Overflow", "v 1 2 -4e38\n", coordinate_out_of_range, 5},
                                           BrokenObj{"Garbage", "\x01\x02\x03 1 2\n", malformed, 5},
                                           BrokenObj{"Number", "1 2 3\n", malformed, 5},
                                           BrokenObj{"Repeated", "f 1 2 1\n", repeated_index_in_face, 5},
                                           BrokenObj{"RepeatedInPolygon", "f 1 2 3 4 2\n", repeated_index_in_face, 5},
                                           BrokenObj{"Duplicate", "f 1 2 3\nf 3 2 1\n", duplicate_face, 6}),
                         [](const auto& tested) { return tested.param.name; });

TEST(Obj, OtherFilesAreNoObj) {
  const auto words = read_text("Once upon a time\nthere was a mesh\n", "obj");
  ASSERT_FALSE(words.ok());
  EXPECT_EQ(words.error().code, wrong_format);
  const auto off = read_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "obj");
  ASSERT_FALSE(off.ok());
  EXPECT_EQ(off.error().code, wrong_format);
  EXPECT_NE(off.error().message.find("looks like a OFF file"), std::string::npos);
}

}  // namespace
}  // namespace pmcd::import::testing
