// SPDX-License-Identifier: GPL-3.0-or-later
// STL: which of the two it is, welding, and refusals.
#include <gtest/gtest.h>

#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;
using Corners = std::array<std::array<float, 3>, 3>;

std::vector<std::byte> binary_stl(const std::vector<Corners>& triangles, std::string header = "made by a test",
                                  float normal = 0, std::uint16_t attribute = 0) {
  header.resize(80, ' ');
  Binary file(header);
  file.put(static_cast<std::uint32_t>(triangles.size()));
  for (const Corners& t : triangles) {
    file.put(0.0f).put(0.0f).put(normal);
    for (const auto& corner : t) {
      for (const float c : corner) file.put(c);
    }
    file.put(attribute);
  }
  return file.bytes();
}

const std::vector<Corners> two_triangles{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}};

std::string facet(const char* a, const char* b, const char* c) {
  return std::string("facet normal 0 0 1\n outer loop\n  vertex ") + a + "\n  vertex " + b + "\n  vertex " + c +
         "\n endloop\nendfacet\n";
}

TEST(Stl, BinaryIsWelded) {
  const auto mesh = read_mesh(binary_stl(two_triangles), "stl");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.positions, (std::vector<Position>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(mesh->report.corners_welded, 2u);
  EXPECT_TRUE(mesh->report.left_out.empty());
}

TEST(Stl, BinaryMayStartWithSolid) {
  const auto mesh = read_mesh(binary_stl(two_triangles, "solid as a rock"), "stl");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.format, "STL, binary");
  EXPECT_EQ(mesh->mesh.faces.size(), 2u);
}

TEST(Stl, NormalsAndAttributesAreLeftOutByName) {
  const auto mesh = read_mesh(binary_stl(two_triangles, "x", 1, 7), "stl");
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->report.left_out, (std::vector<std::string>{"normals of the faces", "attribute bytes of the faces"}));
}

TEST(Stl, AsciiReadsLikeBinary) {
  const std::string text = "solid two words\n" + facet("0 0 0", "1 0 0", "0 1 0") + facet("1 0 0", "1 1 0", "0 1 0") +
                           "endsolid two words\n";
  const auto mesh = read_text(text, "stl");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.format, "STL, ascii");
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_EQ(mesh->report.corners_welded, 2u);
  std::string shouting = "  SOLID\r\n" + facet("0 0 0", "1 0 0", "0 1 0") + "ENDSOLID\r\nsolid b\nendsolid b\n";
  EXPECT_TRUE(read_text(shouting, "stl").ok());
  const auto empty = read_text("solid nothing\nendsolid\n", "stl");
  ASSERT_TRUE(empty.ok());
  EXPECT_TRUE(empty->mesh.faces.empty());
}

TEST(Stl, ZeroesOfDifferentSignAreNotWelded) {
  const std::vector<Corners> apart{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{-0.0f, 0, 0}, {0, 1, 0}, {1, 0, 0}}}};
  const auto mesh = read_mesh(binary_stl(apart), "stl");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.corners_welded, 2u);
  EXPECT_EQ(mesh->mesh.positions.size(), 4u);
  EXPECT_TRUE(std::signbit(mesh->mesh.positions[3][0]));
}

TEST(Stl, WeldedCornersOfOneTriangleAreARepeatedIndex) {
  const auto mesh = read_mesh(binary_stl({two_triangles[0], {{{5, 0, 0}, {5, 0, 0}, {0, 1, 0}}}}), "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, repeated_index_in_face);
  EXPECT_EQ(mesh.error().element, 1u);
  EXPECT_EQ(mesh.error().byte, 84u + 50u);
}

TEST(Stl, WrongSizesAreToldApart) {
  std::vector<std::byte> bytes = binary_stl(two_triangles);
  bytes.pop_back();
  auto mesh = read_mesh(bytes, "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, truncated);
  EXPECT_EQ(mesh.error().byte, 183u);
  bytes.push_back(std::byte{0});
  bytes.push_back(std::byte{0});
  mesh = read_mesh(bytes, "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, trailing_data);
  EXPECT_EQ(mesh.error().byte, 184u);
  // Starts with "solid", yet the zero bytes of its count say that it is a binary file cut short.
  bytes = binary_stl(two_triangles, "solid");
  bytes.resize(150);
  mesh = read_mesh(bytes, "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, truncated);
  mesh = read_text("short", "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, wrong_format);
  std::vector<std::byte> claims = binary_stl({});
  for (std::size_t i = 80; i < 84; ++i) claims[i] = std::byte{0xff};
  mesh = read_mesh(claims, "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, truncated);
}

TEST(Stl, BinaryNanNamesItsByte) {
  std::vector<Corners> triangles = two_triangles;
  triangles[1][2][0] = std::nanf("");
  const auto mesh = read_mesh(binary_stl(triangles), "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, non_finite_coordinate);
  EXPECT_EQ(mesh.error().byte, 84u + 50u + 12u + 24u);
}

struct BrokenStl {
  const char* name;
  std::string from;
  std::string to;
  ImportErrorCode code;
  std::uint64_t line;
  friend std::ostream& operator<<(std::ostream& out, const BrokenStl& broken) { return out << broken.name; }
};

class StlBroken : public ::testing::TestWithParam<BrokenStl> {};

TEST_P(StlBroken, IsRefusedByNameAndLine) {
  std::string text = "solid x\n" + facet("0 0 0", "1 0 0", "0 1 0") + "endsolid x\n";
  const std::size_t at = text.find(GetParam().from);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, GetParam().from.size(), GetParam().to);
  const auto mesh = read_text(text, "stl");
  ASSERT_FALSE(mesh.ok());
  EXPECT_STREQ(error_name(mesh.error().code), error_name(GetParam().code)) << to_line(mesh.error());
  EXPECT_EQ(mesh.error().line, GetParam().line) << to_line(mesh.error());
}

INSTANTIATE_TEST_SUITE_P(
    Stl, StlBroken,
    ::testing::Values(BrokenStl{"Nan", "1 0 0\n", "1 nan 0\n", non_finite_coordinate, 5},
                      BrokenStl{"Overflow", "1 0 0\n", "1e50 0 0\n", coordinate_out_of_range, 5},
                      BrokenStl{"Number", "1 0 0\n", "1 0 zero\n", malformed, 5},
                      BrokenStl{"TwoNumbers", "1 0 0\n", "1 0\n", malformed, 6},
                      BrokenStl{"Word", "outer", "inner", malformed, 3},
                      BrokenStl{"FourthVertex", " endloop", " vertex 1 1 1\n endloop", malformed, 7},
                      BrokenStl{"NoEnd", "endsolid x\n", "", truncated, 9},
                      BrokenStl{"Cut", " endloop\nendfacet\nendsolid x\n", "", truncated, 7},
                      BrokenStl{"Behind", "endsolid x\n", "endsolid x\nmore\n", trailing_data, 10}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace pmcd::import::testing
