// SPDX-License-Identifier: GPL-3.0-or-later
// Every prefix and many damaged copies of small files: each is a mesh or an error with a place, never a crash. Each is
// read from a copy of its own length, so that the address sanitizer sees a read past its end.
#include <gtest/gtest.h>

#include "codec/import/measure.h"
#include "codec/import/write_mesh.h"
#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

struct Sample {
  std::string name;
  std::string extension;
  std::vector<std::byte> bytes;
};

std::vector<Sample> samples() {
  std::vector<Sample> out;
  const TriangleMesh mesh = torus(4, 3);
  for (const std::string extension : {"ply", "obj", "off", "stl"}) {
    out.push_back({extension, extension, format_mesh(mesh, extension)->bytes});
  }
  out.push_back(
      {"ascii ply", "ply",
       bytes_of("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                "property list uchar float w\nelement face 1\nproperty list uchar int vertex_indices\n"
                "property uchar red\nend_header\n0 0 0 1 5\n1 0 0 0\n0 1e0 0 2 1 1\n3 0 1 2 7\n")});
  out.push_back({"ascii stl", "stl",
                 bytes_of("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                          "endfacet\nendsolid a\n")});
  out.push_back({"polygons", "obj", bytes_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 2 \\\n0\nf 1/1 2//2 3 -2 5\n")});
  return out;
}

/// True if it was read. Whatever was read is fit for the encoder; whatever was not says where.
bool check(const Sample& sample, const std::vector<std::byte>& bytes) {
  const auto mesh = read_mesh(bytes, sample.extension);
  if (mesh.ok()) {
    EXPECT_TRUE(is_valid_cgal(mesh->mesh)) << sample.name;
    return true;
  }
  EXPECT_FALSE(mesh.error().message.empty());
  const bool placed = mesh.error().line.has_value() || mesh.error().byte.has_value();
  const bool needs_none =
      mesh.error().code == ImportErrorCode::empty_file || mesh.error().code == ImportErrorCode::compressed;
  EXPECT_TRUE(placed || needs_none) << sample.name << ": " << to_line(mesh.error());
  return false;
}

TEST(Robustness, EveryPrefix) {
  for (const Sample& sample : samples()) {
    ASSERT_TRUE(check(sample, sample.bytes)) << sample.name;
    std::size_t read = 0;
    for (std::size_t n = 0; n < sample.bytes.size(); ++n) {
      std::vector<std::byte> prefix(sample.bytes.begin(), sample.bytes.begin() + static_cast<std::ptrdiff_t>(n));
      prefix.shrink_to_fit();
      read += check(sample, prefix) ? 1 : 0;
    }
    // An OBJ file may end after any line; the others know when something is missing (but for a last line end).
    if (sample.extension != "obj") {
      EXPECT_LE(read, 4u) << sample.name;
    }
  }
}

TEST(Robustness, EveryByteDamaged) {
  for (const Sample& sample : samples()) {
    std::mt19937 random(17);
    for (std::size_t i = 0; i < sample.bytes.size(); ++i) {
      for (int round = 0; round < 4; ++round) {
        std::vector<std::byte> damaged = sample.bytes;
        damaged[i] = round == 0 ? std::byte{0} : round == 1 ? std::byte{0xff} : static_cast<std::byte>(random());
        check(sample, damaged);
      }
    }
  }
}

TEST(Robustness, PiecesCutOutAndRepeated) {
  for (const Sample& sample : samples()) {
    std::mt19937 random(23);
    for (int round = 0; round < 2000; ++round) {
      const auto at = [&] { return static_cast<std::ptrdiff_t>(random() % (sample.bytes.size() + 1)); };
      const auto [from, to] = std::minmax({at(), at()});
      std::vector<std::byte> damaged = sample.bytes;
      if (round % 2 == 0) {
        damaged.erase(damaged.begin() + from, damaged.begin() + to);
      } else {
        const std::vector<std::byte> piece(damaged.begin() + from, damaged.begin() + to);
        damaged.insert(damaged.begin() + at(), piece.begin(), piece.end());
      }
      check(sample, damaged);
    }
  }
}

TEST(Robustness, RandomBytes) {
  std::mt19937 random(29);
  for (const std::string extension : {"ply", "obj", "off", "stl"}) {
    for (std::size_t size = 1; size < 400; ++size) {
      std::vector<std::byte> bytes(size);
      for (std::byte& b : bytes) b = static_cast<std::byte>(random());
      EXPECT_FALSE(read_mesh(bytes, extension).ok());
    }
  }
}

}  // namespace
}  // namespace pmcd::import::testing
