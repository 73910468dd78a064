// SPDX-License-Identifier: MIT
// The proof of an encoding: it sees whatever is wrong with packets, numbering, positions or faces, and shows each level
// on the way.
#include "codec/proof.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

TriangleMesh awkward_mesh() {
  Random random(31);
  TriangleMesh mesh = joined(joined(sphere(3), grid(7, 7, 2)), tetrahedron());
  jitter(mesh, 0.02, random);
  add_isolated(mesh, 6, random);
  return mesh;
}

Encoded encoded(const TriangleMesh& mesh, std::optional<unsigned> bits) {
  EncodeOptions options;
  options.bits = bits;
  Result<Encoded> result = encode(mesh, options);
  EXPECT_TRUE(result.ok());
  return result ? std::move(result).value() : Encoded{};
}

void expect_broken(const Encoded& encoded, const TriangleMesh& original, const std::string& what) {
  const Status proven = prove(encoded, original);
  ASSERT_FALSE(proven.ok()) << what;
  EXPECT_EQ(proven.error().code, ErrorCode::internal_error);
  EXPECT_EQ(proven.error().detail, "the encoder's proof failed: " + what);
}

TEST(Proof, HoldsForTheOriginalInAnyOrderOfFaces) {
  TriangleMesh mesh = awkward_mesh();
  for (const std::optional<unsigned> bits : {std::optional<unsigned>(), std::optional(12u)}) {
    const Encoded done = encoded(mesh, bits);
    EXPECT_TRUE(prove(done, mesh).ok());
    TriangleMesh other = mesh;
    std::reverse(other.faces.begin(), other.faces.end());
    for (Face& face : other.faces) std::rotate(face.begin(), face.begin() + 1, face.end());
    EXPECT_TRUE(prove(done, other).ok());
  }
}

TEST(Proof, ClaimsNumberEachVertexOnce) {
  const TriangleMesh mesh = awkward_mesh();
  const Claim lossless = encoded(mesh, std::nullopt).claim;
  const Claim snapped = encoded(mesh, 12).claim;
  EXPECT_TRUE(lossless.lossless);
  EXPECT_FALSE(snapped.lossless);
  EXPECT_EQ(snapped.lattice.bits, 12u);
  std::vector<std::uint32_t> each(mesh.positions.size());
  std::iota(each.begin(), each.end(), 0u);
  for (const Claim& claim : {lossless, snapped}) {
    std::vector<std::uint32_t> sorted = claim.to_original;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(sorted, each);
  }
}

TEST(Proof, SeesPacketsThatAreMissingSwappedOrStrange) {
  const TriangleMesh mesh = awkward_mesh();
  const Encoded good = encoded(mesh, 12);
  ASSERT_GE(good.packets.size(), 4u);
  expect_broken({}, mesh, "the last packet is missing");
  Encoded bad = good;
  bad.packets.pop_back();
  expect_broken(bad, mesh, "the last packet is missing");
  bad = good;
  std::swap(bad.packets[1], bad.packets[2]);
  expect_broken(bad, mesh, "packet 1: packet 1 comes next, this is packet 2");
  bad = good;
  bad.packets.push_back(good.packets.back());
  expect_broken(bad, mesh,
                "packet " + std::to_string(good.packets.size()) + ": the mesh is complete, no packet follows");
  bad = good;
  bad.packets[2] = encoded(sphere(4), 12).packets[2];
  expect_broken(bad, mesh, "packet 2: the packet belongs to another mesh or another encoding of it");
  bad = good;
  bad.packets[3].bytes.back() ^= std::byte{1};
  const Status damaged = prove(bad, mesh);
  ASSERT_FALSE(damaged.ok());
  EXPECT_EQ(damaged.error().detail.find("the encoder's proof failed: packet 3: "), 0u) << damaged.error().detail;
}

TEST(Proof, SeesAPositionThatDiffersInOneBit) {
  TriangleMesh mesh = awkward_mesh();
  Encoded done = encoded(mesh, std::nullopt);
  double& moved = mesh.positions[17][1];
  moved = static_cast<double>(std::nextafterf(static_cast<float>(moved), 9.0F));
  expect_broken(done, mesh, "vertex 17 has moved");
  mesh = awkward_mesh();
  mesh.positions[40][2] = 0.0;
  done = encoded(mesh, std::nullopt);
  mesh.positions[40][2] = -0.0;
  expect_broken(done, mesh, "vertex 40 has moved");
}

TEST(Proof, SeesALatticeVertexOneStepAway) {
  TriangleMesh mesh = awkward_mesh();
  const Encoded done = encoded(mesh, 12);
  const double step = done.claim.lattice.step;
  ASSERT_GT(step, 0);
  mesh.positions[17][1] += mesh.positions[17][1] > 0 ? -step : step;
  expect_broken(done, mesh, "vertex 17 has moved");
}

TEST(Proof, SeesAWrongNumbering) {
  const TriangleMesh mesh = awkward_mesh();
  const Encoded good = encoded(mesh, std::nullopt);
  Encoded bad = good;
  std::swap(bad.claim.to_original[3], bad.claim.to_original[4]);
  expect_broken(bad, mesh, "vertex " + std::to_string(bad.claim.to_original[3]) + " has moved");
  bad = good;
  bad.claim.to_original[3] = static_cast<std::uint32_t>(mesh.positions.size());
  expect_broken(bad, mesh, "the numbering is no bijection");
  bad.claim.to_original.pop_back();
  expect_broken(bad, mesh, "counts differ");
}

TEST(Proof, SeesAWrongNumberingOfVerticesAtOnePlace) {
  TriangleMesh mesh = octahedron();
  const std::uint32_t a = mesh.faces[0][0];
  const std::uint32_t b = mesh.faces[0][1];
  mesh.positions[b] = mesh.positions[a];
  const Encoded good = encoded(mesh, 12);
  Encoded bad = good;
  std::vector<std::uint32_t>& numbering = bad.claim.to_original;
  std::replace(numbering.begin(), numbering.end(), b, a);
  expect_broken(bad, mesh, "the numbering is no bijection");
  bad = good;
  for (std::uint32_t& o : numbering) o = o == a ? b : o == b ? a : o;
  expect_broken(bad, mesh, "faces differ");
}

TEST(Proof, SeesOtherFaces) {
  const TriangleMesh mesh = awkward_mesh();
  const Encoded done = encoded(mesh, std::nullopt);
  TriangleMesh other = mesh;
  std::swap(other.faces[5][0], other.faces[5][1]);
  expect_broken(done, other, "faces differ");
  other = mesh;
  other.faces[5] = other.faces[6];
  expect_broken(done, other, "faces differ");
  other.faces.pop_back();
  expect_broken(done, other, "counts differ");
  other = mesh;
  other.positions.push_back({0, 0, 0});
  expect_broken(done, other, "counts differ");
}

TEST(Proof, ShowsEachLevelOnce) {
  const TriangleMesh mesh = awkward_mesh();
  for (const std::optional<unsigned> bits : {std::optional<unsigned>(), std::optional(12u)}) {
    const Encoded done = encoded(mesh, bits);
    std::size_t shown = 0;
    const Status proven = prove(done, mesh, [&](std::size_t k, const Decoder& decoder) {
      EXPECT_EQ(k, shown++);
      EXPECT_EQ(decoder.level().level, k);
      EXPECT_EQ(decoder.level().last, k + 1 == done.packets.size());
      EXPECT_EQ(decoder.mesh().positions.size(), done.packets[k].vertices);
      EXPECT_EQ(decoder.mesh().faces.size(), done.packets[k].faces);
      return true;
    });
    EXPECT_TRUE(proven.ok());
    EXPECT_EQ(shown, done.packets.size());
  }
}

TEST(Proof, NoAtAnyLevelCancels) {
  const TriangleMesh mesh = awkward_mesh();
  const Encoded done = encoded(mesh, 12);
  for (std::size_t stop = 0; stop < done.packets.size(); ++stop) {
    std::size_t asked = 0;
    const Status proven = prove(done, mesh, [&](std::size_t k, const Decoder&) {
      ++asked;
      return k < stop;
    });
    ASSERT_FALSE(proven.ok()) << stop;
    EXPECT_EQ(proven.error().code, ErrorCode::cancelled);
    EXPECT_EQ(asked, stop + 1);
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
