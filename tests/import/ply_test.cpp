// SPDX-License-Identifier: GPL-3.0-or-later
// PLY in all its variants, and what is said about broken ones.
#include <gtest/gtest.h>

#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

constexpr std::string_view kAscii =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 0.1\n3 0 1 2\n3 0 3 1\n";

TEST(Ply, ReadsAscii) {
  const auto mesh = read_text(kAscii, "ply");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.scalar, Scalar::float32);
  ASSERT_EQ(mesh->mesh.positions.size(), 4u);
  EXPECT_EQ(mesh->mesh.positions[3], (Position{0, 0, static_cast<double>(0.1f)}));
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}, {0, 3, 1}}));
  EXPECT_EQ(mesh->report.format, "PLY, ascii");
  EXPECT_TRUE(mesh->report.left_out.empty());
}

TEST(Ply, ReadsAsciiWithCrLfAndBlankLines) {
  std::string text;
  for (const char c : kAscii) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  const auto mesh = read_text(text + "\r\n \r\n", "ply");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{0, 1, 2}, {0, 3, 1}}));
}

TEST(Ply, TextBecomesNearestFloatOrDoubleAsAsked) {
  // Between two floats and one ulp of double above their middle: rounding by way of double would go to the lower one.
  const std::string text = std::string(kAscii).replace(kAscii.find("0 0 0.1"), 7, "0 0 1.00000005960464477540");
  const auto narrow = read_text(text, "ply");
  ASSERT_TRUE(narrow.ok());
  EXPECT_EQ(narrow->mesh.positions[3][2], static_cast<double>(std::nextafter(1.0f, 2.0f)));
  const auto wide = read_text(kAscii, "ply", {.strict = false, .as_double = true});
  ASSERT_TRUE(wide.ok());
  EXPECT_EQ(wide->mesh.scalar, Scalar::float64);
  EXPECT_EQ(wide->mesh.positions[3][2], 0.1);
}

TEST(Ply, PropertyTypeDoubleStaysDouble) {
  std::string text(kAscii);
  for (std::size_t at = text.find("float"); at != std::string::npos; at = text.find("float"))
    text.replace(at, 5, "double");
  const auto mesh = read_text(text, "ply");
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->mesh.scalar, Scalar::float64);
  EXPECT_EQ(mesh->mesh.positions[3][2], 0.1);
  EXPECT_TRUE(mesh->report.float64);
}

class PlyBinary : public ::testing::TestWithParam<bool> {
 protected:
  [[nodiscard]] std::string format() const {
    return GetParam() ? "format binary_big_endian 1.0\n" : "format binary_little_endian 1.0\n";
  }
};

TEST_P(PlyBinary, KeepsFloatBits) {
  Binary file("ply\n" + format() +
                  "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
                  "property list uchar int vertex_index\nend_header\n",
              GetParam());
  for (const float c : {-0.0f, 0.0f, 1e-45f, 0.1f, 3.4028235e38f, -1.5f, 7.0f, 8.0f, 9.0f}) file.put(c);
  file.put(std::uint8_t{3}).put(std::int32_t{2}).put(std::int32_t{0}).put(std::int32_t{1});
  const auto mesh = read_mesh(file.bytes(), "ply");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.scalar, Scalar::float32);
  EXPECT_TRUE(std::signbit(mesh->mesh.positions[0][0]));
  EXPECT_FALSE(std::signbit(mesh->mesh.positions[0][1]));
  EXPECT_EQ(mesh->mesh.positions[0][2], static_cast<double>(1e-45f));
  EXPECT_EQ(mesh->mesh.positions[1][1], static_cast<double>(3.4028235e38f));
  EXPECT_EQ(mesh->mesh.faces, (std::vector<Face>{{2, 0, 1}}));
}

TEST_P(PlyBinary, ReadsEveryTypeAndSkipsWhatItDoesNotKeep) {
  Binary file(
      "ply\r\n" + format() +
          "element vertex 3\r\nproperty uchar red\r\nproperty short z\r\nproperty list ushort double weights\r\n"
          "property double x\r\nproperty float ny\r\nproperty char y\r\nelement camera 2\r\n"
          "property list uint8 int16 view\r\nproperty float64 angle\r\nelement face 2\r\nproperty uint32 id\r\n"
          "property list uint ushort vertex_indices\r\nproperty list float32 uint8 texcoord\r\n"
          "element note 1\r\nproperty int a\r\nend_header\r\n",
      GetParam());
  const auto vertex = [&](double x, std::int8_t y, std::int16_t z, std::uint16_t weights) {
    file.put(std::uint8_t{200}).put(z).put(weights);
    for (std::uint16_t i = 0; i < weights; ++i) file.put(0.25);
    file.put(x).put(1.0f).put(y);
  };
  vertex(0.1, -1, 300, 0);
  vertex(0.2, 2, -300, 2);
  vertex(-0.0, 3, 0, 1);
  for (int camera = 0; camera < 2; ++camera) file.put(std::uint8_t{1}).put(std::int16_t{5}).put(0.5);
  file.put(std::uint32_t{77}).put(std::uint32_t{3}).put(std::uint16_t{0}).put(std::uint16_t{1}).put(std::uint16_t{2});
  file.put(2.0f).put(std::uint8_t{1}).put(std::uint8_t{2});
  file.put(std::uint32_t{78}).put(std::uint32_t{3}).put(std::uint16_t{2}).put(std::uint16_t{1}).put(std::uint16_t{0});
  file.put(0.0f);
  file.put(std::int32_t{9});
  const std::vector<std::byte> bytes = file.bytes();
  const auto raw = read_ply(bytes, {});
  ASSERT_TRUE(raw.ok()) << to_line(raw.error());
  EXPECT_EQ(raw->scalar, Scalar::float64);
  EXPECT_EQ(raw->positions, (std::vector<Position>{{0.1, -1, 300}, {0.2, 2, -300}, {0, 3, 0}}));
  EXPECT_EQ(raw->corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
  EXPECT_EQ(raw->left_out,
            (std::vector<std::string>{"colours of the vertices (red)", "normals of the vertices (ny)",
                                      "other properties of the vertices (weights)", "element 'camera', 2 items",
                                      "texture coordinates of the faces (texcoord)",
                                      "other properties of the faces (id)", "element 'note', 1 items"}));
  // Both faces have the same vertices.
  const auto mesh = read_mesh(bytes, "ply");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, ImportErrorCode::duplicate_face);
  EXPECT_EQ(mesh.error().element, 1u);
  EXPECT_EQ(mesh.error().byte, raw->polygon_place[1]);
  EXPECT_EQ(raw->polygon_place[1], bytes.size() - 4 - 18);
}

INSTANTIATE_TEST_SUITE_P(Endian, PlyBinary, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "Big" : "Little"; });

TEST(Ply, FacesMayStandBeforeVertices) {
  const auto mesh = read_text(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nelement vertex 3\n"
      "property float x\nproperty float y\nproperty float z\nend_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n",
      "ply");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces.size(), 1u);
}

TEST(Ply, EmptyMeshIsAMesh) {
  const auto mesh = read_text(
      "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
      "ply");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_TRUE(mesh->mesh.positions.empty());
}

struct BrokenPly {
  const char* name;
  std::string from;  ///< replaced in kAscii ...
  std::string to;    ///< ... by this
  ImportErrorCode code;
  std::uint64_t line;
  friend std::ostream& operator<<(std::ostream& out, const BrokenPly& broken) { return out << broken.name; }
};

class PlyBroken : public ::testing::TestWithParam<BrokenPly> {};

TEST_P(PlyBroken, IsRefusedByNameAndLine) {
  const BrokenPly& broken = GetParam();
  const std::size_t at = kAscii.find(broken.from);
  ASSERT_NE(at, std::string_view::npos);
  const auto mesh = read_text(std::string(kAscii).replace(at, broken.from.size(), broken.to), "ply");
  ASSERT_FALSE(mesh.ok());
  EXPECT_STREQ(error_name(mesh.error().code), error_name(broken.code)) << to_line(mesh.error());
  EXPECT_EQ(mesh.error().line, broken.line) << to_line(mesh.error());
  EXPECT_FALSE(mesh.error().byte.has_value());
}

using enum ImportErrorCode;

INSTANTIATE_TEST_SUITE_P(Ply, PlyBroken,
                         ::testing::Values(BrokenPly{"Magic", "ply\n", "plyx\n", wrong_format, 1},
                                           BrokenPly{"Format", "ascii", "ebcdic", unsupported_variant, 2},
                                           BrokenPly{"Version", "1.0", "2.0", unsupported_variant, 2},
                                           BrokenPly{"NoFormat", "format ascii 1.0\n", "", malformed, 9},
                                           BrokenPly{"Keyword", "comment", "komment", malformed, 3},
                                           BrokenPly{"Count", "vertex 4", "vertex four", malformed, 4},
                                           BrokenPly{"NegativeCount", "vertex 4", "vertex -4", malformed, 4},
                                           BrokenPly{"Type", "property float y", "property quad y", malformed, 6},
                                           BrokenPly{"NoX", "property float x", "property float w", malformed, 10},
                                           BrokenPly{"XTwice", "property float y", "property float x", malformed, 10},
                                           BrokenPly{"NoCornerList", "vertex_indices", "corners", malformed, 10},
                                           BrokenPly{"NoEndHeader", "end_header", "end_headr", malformed, 10},
                                           BrokenPly{"Nan", "0 1 0", "0 nan 0", non_finite_coordinate, 13},
                                           BrokenPly{"Infinite", "0 1 0", "0 -inf 0", non_finite_coordinate, 13},
                                           BrokenPly{"Overflow", "0 1 0", "0 1e39 0", coordinate_out_of_range, 13},
                                           BrokenPly{"NotANumber", "0 1 0", "0 1,5 0", malformed, 13},
                                           BrokenPly{"TooFewValues", "0 1 0", "0 1", malformed, 13},
                                           BrokenPly{"TooManyValues", "0 1 0", "0 1 0 5", malformed, 13},
                                           BrokenPly{"IndexTooLarge", "3 0 3 1", "3 0 4 1", index_out_of_range, 16},
                                           BrokenPly{"IndexNegative", "3 0 3 1", "3 0 -1 1", index_out_of_range, 16},
                                           BrokenPly{"IndexFraction", "3 0 3 1", "3 0 1.5 1", index_out_of_range, 16},
                                           BrokenPly{"TwoCorners", "3 0 3 1", "2 0 3", too_few_corners, 16},
                                           BrokenPly{"ListLength", "3 0 3 1", "-3 0 3 1", malformed, 16},
                                           BrokenPly{"MissingCorner", "3 0 3 1", "3 0 3", malformed, 16},
                                           BrokenPly{"RepeatedIndex", "3 0 3 1", "3 0 3 3", repeated_index_in_face, 16},
                                           BrokenPly{"Truncated", "3 0 3 1\n", "", truncated, 16},
                                           BrokenPly{"Trailing", "3 0 3 1\n", "3 0 3 1\n3 1 3 2\n", trailing_data, 17},
                                           BrokenPly{"HugeVertexCount", "vertex 4", "vertex 2147483648", malformed, 15},
                                           BrokenPly{"HugeFaceCount", "face 2", "face 2147483648", truncated, 17}),
                         [](const auto& tested) { return tested.param.name; });

TEST(Ply, BinaryErrorsNameTheByte) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  Binary nan(header);
  nan.put(1.0f).put(2.0f).put(3.0f).put(1.0f).put(std::nanf("")).put(3.0f).put(std::uint8_t{3});
  auto mesh = read_mesh(nan.bytes(), "ply");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, non_finite_coordinate);
  EXPECT_EQ(mesh.error().byte, header.size() + 12);
  EXPECT_EQ(mesh.error().element, 1u);
  EXPECT_NE(mesh.error().message.find("coordinate y"), std::string::npos);

  Binary index(header);
  for (int i = 0; i < 6; ++i) index.put(static_cast<float>(i));
  index.put(std::uint8_t{3}).put(std::int32_t{0}).put(std::int32_t{1}).put(std::int32_t{-2});
  mesh = read_mesh(index.bytes(), "ply");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, index_out_of_range);
  EXPECT_EQ(mesh.error().byte, header.size() + 24);
  EXPECT_EQ(mesh.error().element, 0u);

  Binary cut(header);
  cut.put(1.0f);
  mesh = read_mesh(cut.bytes(), "ply");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, truncated);
  EXPECT_EQ(mesh.error().byte, header.size() + 4);
}

TEST(Ply, BinaryClaimsAreNotBelieved) {
  for (const char* claim : {"2147483648", "4294967296", "9223372036854775807"}) {
    for (const char* element : {"vertex", "face", "other"}) {
      std::string header = "ply\nformat binary_little_endian 1.0\n";
      const auto declare = [&](const std::string& name, const std::string& properties) {
        header.append("element ").append(name).append(" ").append(name == element ? claim : "0").append("\n");
        header.append(properties);
      };
      declare("vertex", "property float x\nproperty float y\nproperty float z\n");
      declare("face", "property list uchar int vertex_indices\n");
      declare("other", "property list uint double things\n");
      const auto mesh = read_text(header + "end_header\n12345678", "ply");
      ASSERT_FALSE(mesh.ok()) << claim << " " << element;
      EXPECT_EQ(mesh.error().code, truncated) << to_line(mesh.error());
    }
  }
  // A list that claims more items than there are bytes.
  Binary list(
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property list uint double w\nend_header\n");
  list.put(1.0f).put(1.0f).put(1.0f).put(std::uint32_t{0xffffffff});
  const auto mesh = read_mesh(list.bytes(), "ply");
  ASSERT_FALSE(mesh.ok());
  EXPECT_EQ(mesh.error().code, truncated);
}

TEST(Ply, ElementsWithoutPropertiesTakeNoTime) {
  const auto mesh = read_text(
      "ply\nformat binary_little_endian 1.0\nelement nothing 9223372036854775807\nelement vertex 0\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n",
      "ply");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->report.left_out.size(), 1u);
}

TEST(Ply, StrictNamesWhatWouldBeLeftOut) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty float confidence\nend_header\n0 0 0 255 1\n";
  const auto relaxed = read_text(text, "ply");
  ASSERT_TRUE(relaxed.ok());
  EXPECT_EQ(relaxed->report.left_out, (std::vector<std::string>{"colours of the vertices (red)",
                                                                "other properties of the vertices (confidence)"}));
  const auto strict = read_text(text, "ply", {.strict = true, .as_double = false});
  ASSERT_FALSE(strict.ok());
  EXPECT_EQ(strict.error().code, left_out);
  EXPECT_NE(strict.error().message.find("colours of the vertices (red)"), std::string::npos);
  EXPECT_NE(strict.error().message.find("confidence"), std::string::npos);
  EXPECT_TRUE(read_text(kAscii, "ply", {.strict = true, .as_double = false}).ok());
}

}  // namespace
}  // namespace pmcd::import::testing
