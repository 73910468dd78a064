// SPDX-License-Identifier: GPL-3.0-or-later
// Writing and reading back keeps bits; nothing half-written remains.
#include "codec/import/write_mesh.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <limits>

#include "codec/import/file_io.h"
#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

using enum ImportErrorCode;

bool same_bits(const std::vector<Position>& a, const std::vector<Position>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t v = 0; v < a.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (std::bit_cast<std::uint64_t>(a[v][k]) != std::bit_cast<std::uint64_t>(b[v][k])) return false;
    }
  }
  return true;
}

TriangleMesh odd_floats() {
  TriangleMesh mesh = tetrahedron();
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kSmallest = std::numeric_limits<float>::denorm_min();
  mesh.positions[0] = {-0.0, 0.0, static_cast<double>(kSmallest)};
  mesh.positions[1] = {static_cast<double>(kLargest), static_cast<double>(-kLargest), as_float(0.1)};
  mesh.positions[2] = {as_float(1.0 / 3), as_float(-123456.789), static_cast<double>(1e-40f)};
  std::mt19937 random(1);
  for (int i = 0; i < 500; ++i) {
    Position p{};
    for (double& c : p) {
      float f = 0;
      do {
        f = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
      } while (!std::isfinite(f));
      c = static_cast<double>(f);
    }
    mesh.positions.push_back(p);
  }
  return mesh;
}

TEST(Write, FloatBitsComeBackFromEveryFormat) {
  const TriangleMesh mesh = odd_floats();
  for (const std::string extension : {"ply", "obj", "off"}) {
    const auto written = format_mesh(mesh, extension);
    ASSERT_TRUE(written.ok());
    EXPECT_TRUE(written->notes.empty());
    const auto back = read_mesh(written->bytes, extension, {.strict = true, .as_double = false});
    ASSERT_TRUE(back.ok()) << to_line(back.error());
    EXPECT_EQ(back->mesh.scalar, Scalar::float32);
    EXPECT_TRUE(same_bits(back->mesh.positions, mesh.positions)) << extension;
    EXPECT_EQ(back->mesh.faces, mesh.faces) << extension;
  }
}

TEST(Write, DoubleBitsComeBack) {
  TriangleMesh mesh = tetrahedron();
  mesh.scalar = Scalar::float64;
  mesh.positions[0] = {-0.0, 1e-320, 1.7976931348623157e308};
  mesh.positions[1] = {0.1, 1.0 / 3, -2.2250738585072014e-308};
  for (const std::string extension : {"ply", "obj", "off"}) {
    const auto written = format_mesh(mesh, extension);
    ASSERT_TRUE(written.ok());
    EXPECT_EQ(written->notes.size(), extension == "ply" ? 0u : 1u);
    const auto back = read_mesh(written->bytes, extension, {.strict = false, .as_double = extension != "ply"});
    ASSERT_TRUE(back.ok()) << to_line(back.error());
    EXPECT_EQ(back->mesh.scalar, Scalar::float64);
    EXPECT_TRUE(same_bits(back->mesh.positions, mesh.positions)) << extension;
  }
}

TEST(Write, StlKeepsWhatItCanAndTellsTheRest) {
  TriangleMesh mesh = torus(5, 4);
  mesh.positions.push_back({9, 9, 9});
  const auto written = format_mesh(mesh, "stl");
  ASSERT_TRUE(written.ok());
  ASSERT_EQ(written->notes.size(), 2u);
  EXPECT_NE(written->notes[1].find("isolated vertices not written: 1"), std::string::npos);
  EXPECT_EQ(written->bytes.size(), 84u + 50u * 40u);
  const auto back = read_mesh(written->bytes, "stl");
  ASSERT_TRUE(back.ok()) << to_line(back.error());
  EXPECT_EQ(back->mesh.positions.size(), 20u);
  EXPECT_EQ(back->mesh.faces.size(), 40u);
  mesh.scalar = Scalar::float64;
  EXPECT_TRUE(format_mesh(mesh, "stl").ok());
  mesh.positions[3][1] = 0.1;
  const auto refused = format_mesh(mesh, "stl");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, cannot_write);
  EXPECT_EQ(refused.error().element, 3u);
}

TEST(Write, StlNormalsPointOutwards) {
  const auto written = format_mesh(tetrahedron(), "stl");
  ASSERT_TRUE(written.ok());
  // Face {0, 2, 1} of the tetrahedron lies in z = 0 and looks down.
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < 4; ++i) bits |= std::to_integer<std::uint32_t>(written->bytes[84 + 8 + i]) << 8 * i;
  EXPECT_EQ(std::bit_cast<float>(bits), -1.0f);
}

TEST(Write, UnknownExtensionIsRefused) {
  const auto refused = write_mesh("/nowhere/mesh.xyz", tetrahedron());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, unknown_extension);
  EXPECT_EQ(refused.error().file, "/nowhere/mesh.xyz");
}

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(SaveFile, ReplacesWhollyOrNotAtAll) {
  TemporaryFolder folder;
  const std::string path = folder.file("a.ply");
  ASSERT_FALSE(save_file(path, bytes_of("first")).has_value());
  ASSERT_FALSE(save_file(path, bytes_of("second")).has_value());
  EXPECT_EQ(content(path), "second");
  EXPECT_EQ(folder.entries(), 1u);
  const ImportFailure failure = save_file(folder.file("no/such/folder.ply"), bytes_of("x"));
  ASSERT_TRUE(failure.has_value());
  EXPECT_EQ(failure->code, cannot_write);
  EXPECT_EQ(save_file(folder.file(""), bytes_of("x"))->code, cannot_write);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(SaveFile, WritesThroughASymbolicLink) {
  TemporaryFolder folder;
  ASSERT_FALSE(save_file(folder.file("real"), bytes_of("old")).has_value());
  ASSERT_EQ(::symlink("real", folder.file("link").c_str()), 0);
  ASSERT_FALSE(save_file(folder.file("link"), bytes_of("new")).has_value());
  EXPECT_TRUE(std::filesystem::is_symlink(folder.file("link")));
  EXPECT_EQ(content(folder.file("real")), "new");
}

TEST(SaveFile, LeavesADeviceADevice) {
  struct stat before {};
  ASSERT_EQ(::stat("/dev/null", &before), 0);
  ASSERT_TRUE(S_ISCHR(before.st_mode));
  EXPECT_FALSE(save_file("/dev/null", bytes_of("gone")).has_value());
  struct stat after {};
  ASSERT_EQ(::stat("/dev/null", &after), 0);
  EXPECT_TRUE(S_ISCHR(after.st_mode));
  // A full disk: the error arrives, the name does not.
  const ImportFailure full = save_file("/dev/full", bytes_of("x"));
  ASSERT_TRUE(full.has_value());
  EXPECT_EQ(full->code, cannot_write);
}

TEST(ExtensionOf, IsLowerCaseWithoutDot) {
  EXPECT_EQ(extension_of("/a.b/mesh.STL"), "stl");
  EXPECT_EQ(extension_of("/a.b/mesh"), "");
  EXPECT_EQ(extension_of("mesh.ply.gz"), "gz");
}

}  // namespace
}  // namespace pmcd::import::testing
