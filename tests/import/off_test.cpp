// SPDX-License-Identifier: GPL-3.0-or-later
// OFF headers, colours and refusals.
#include <gtest/gtest.h>

#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;

TEST(Off, CountsOnTheSameOrTheNextLine) {
  for (const char* head : {"OFF\n3 1 0\n", "OFF 3 1 0\n", "OFF\n3 1\n", "# first\n\nOFF # here\n\n# and there\n3 1 3\n",
                           "OFF\r\n3 1 0\r\n"}) {
    const auto mesh = read_text(std::string(head) + "0 0 0\n1 0 0 # last\n\n0 1 0\n3 0 1 2\n", "off");
    ASSERT_TRUE(mesh.ok()) << head << to_line(mesh.error());
    EXPECT_EQ(mesh->mesh.positions[2], (Position{0, 1, 0}));
    EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}}));
    EXPECT_TRUE(mesh->report.left_out.empty());
  }
}

TEST(Off, PrefixesAreLeftOut) {
  const auto colours =
      read_text("COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 255\n0 1 0 9 9 9 255\n3 0 1 2 255 0 0\n", "off");
  ASSERT_TRUE(colours.ok());
  EXPECT_EQ(colours->report.left_out, (std::vector<std::string>{"colours of 3 vertices", "colours of 1 faces"}));
  EXPECT_EQ(colours->report.format, "COFF");
  const auto all = read_text("STCNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 1 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "off");
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->report.left_out, (std::vector<std::string>{"normals, colours, texture coordinates of 1 vertices"}));
  EXPECT_TRUE(read_text("NOFF\n1 0 0\n0 0 0 0 0 1\n", "off").ok());
}

struct BrokenOff {
  const char* name;
  std::string text;
  ImportErrorCode code;
  std::uint64_t line;
  friend std::ostream& operator<<(std::ostream& out, const BrokenOff& broken) { return out << broken.name; }
};

class OffBroken : public ::testing::TestWithParam<BrokenOff> {};

TEST_P(OffBroken, IsRefusedByNameAndLine) {
  const auto mesh = read_text(GetParam().text, "off");
  ASSERT_FALSE(mesh.ok());
  EXPECT_STREQ(error_name(mesh.error().code), error_name(GetParam().code)) << to_line(mesh.error());
  EXPECT_EQ(mesh.error().line, GetParam().line) << to_line(mesh.error());
}

INSTANTIATE_TEST_SUITE_P(
    Off, OffBroken,
    ::testing::Values(
        BrokenOff{"FourDimensions", "4OFF\n1 0 0\n0 0 0 1\n", unsupported_variant, 1},
        BrokenOff{"AnyDimensions", "nOFF\n5\n1 0 0\n0 0 0 1 1\n", unsupported_variant, 1},
        BrokenOff{"Binary", "OFF BINARY\n\x01\x02", unsupported_variant, 1},
        BrokenOff{"NoKeyword", "3 1 0\n0 0 0\n", wrong_format, 1}, BrokenOff{"Comment", "# nothing\n", wrong_format, 2},
        BrokenOff{"NoCounts", "OFF\n", truncated, 2}, BrokenOff{"Counts", "OFF\nthree 1 0\n", malformed, 2},
        BrokenOff{"NegativeCount", "OFF\n-3 1 0\n", malformed, 2},
        BrokenOff{"HugeVertexCount", "OFF\n2147483648 0 0\n0 0 0\n", truncated, 4},
        BrokenOff{"HugeFaceCount", "OFF\n3 2147483648 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", truncated, 7},
        BrokenOff{"HugeCorners", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2147483648 0 1 2\n", malformed, 6},
        BrokenOff{"Index", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", index_out_of_range, 6},
        BrokenOff{"NegativeIndex", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", index_out_of_range, 6},
        BrokenOff{"TwoCorners", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n", too_few_corners, 6},
        BrokenOff{"Nan", "OFF\n1 0 0\n0 nan 0\n", non_finite_coordinate, 3},
        BrokenOff{"Infinity", "OFF\n1 0 0\n0 infinity 0\n", non_finite_coordinate, 3},
        BrokenOff{"ShortVertex", "OFF\n1 0 0\n0 0\n", malformed, 3},
        BrokenOff{"TrailingFace", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 2 1 0\n", trailing_data, 7}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace pmcd::import::testing
