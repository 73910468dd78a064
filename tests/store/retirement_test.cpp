// SPDX-License-Identifier: MIT
// Meshes that were replaced or removed: out of sight at once, readable until they are collected, collected in steps.
#include <gtest/gtest.h>

#include <filesystem>
#include <vector>

#include "daemon/store/db.h"
#include "daemon/store/mesh_store.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/mesh_store_fixture.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

using test::fake_mesh;
using test::FakeMesh;

class RetirementTest : public MeshStoreFixture {
 protected:
  MeshId put(const std::string& name, const FakeMesh& mesh) {
    const auto inserted = insert(name, mesh, true);
    EXPECT_EQ(outcome(inserted), "ok");
    return inserted.ok() ? inserted.value().mesh.id : 0;
  }

  void expect_readable(MeshId id, const FakeMesh& mesh) {
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      const auto packet = store_->read_packet(id, static_cast<std::uint32_t>(level));
      ASSERT_TRUE(packet.ok()) << packet.error().detail;
      EXPECT_EQ(packet.value(), mesh.packets[level]);
    }
  }

  std::vector<std::string> listed() { return names(store_->list().value()); }

  std::int64_t packets() { return Db(path_).number("SELECT count(*) FROM packet"); }
};

TEST_F(RetirementTest, ARemovedMeshIsReadButNotSeen) {
  const FakeMesh mesh = fake_mesh(6, {1, 2, 3});
  const MeshId id = put("m", mesh);
  put("n", fake_mesh(7, {1}));
  const auto removed = store_->remove("m");
  ASSERT_TRUE(removed.ok());
  EXPECT_EQ(removed.value().mesh, id);
  EXPECT_EQ(removed.value().generation, mesh.directory.generation);
  EXPECT_EQ(listed(), std::vector<std::string>{"n"});
  EXPECT_EQ(outcome(store_->find("m")), "unknown_mesh");
  EXPECT_FALSE(store_->contains("m").value());
  EXPECT_EQ(outcome(store_->remove("m")), "unknown_mesh");
  expect_readable(id, mesh);
  EXPECT_EQ(outcome(store_->read_packet(id, 3)), "unknown_packet");
  reopen();
  EXPECT_EQ(store_->retired().value(), std::vector<MeshId>{id});
  expect_readable(id, mesh);
}

TEST_F(RetirementTest, AReplacedMeshIsReadBesideItsSuccessor) {
  const FakeMesh first = fake_mesh(4, {100, 100});
  const FakeMesh second = fake_mesh(5, {10, 10, 10});
  const FakeMesh third = fake_mesh(6, {10});
  const MeshId first_id = put("m", first);
  const MeshId second_id = put("m", second);
  const MeshId third_id = put("m", third);
  EXPECT_EQ(listed(), std::vector<std::string>{"m"});
  EXPECT_EQ(store_->find("m").value().summary.id, third_id);
  expect_readable(first_id, first);
  expect_readable(second_id, second);
  expect_readable(third_id, third);
  EXPECT_EQ(store_->retired().value(), (std::vector<MeshId>{first_id, second_id}));
  EXPECT_EQ(store_->collect(first_id).value(), Collected::all);
  EXPECT_EQ(outcome(store_->read_packet(first_id, 0)), "unknown_mesh");
  expect_readable(second_id, second);
  EXPECT_EQ(store_->retired().value(), std::vector<MeshId>{second_id});
  EXPECT_EQ(packets(), 4);
}

TEST_F(RetirementTest, ALiveMeshIsNotCollected) {
  const FakeMesh mesh = fake_mesh(6, {1, 2});
  const MeshId id = put("m", mesh);
  EXPECT_EQ(store_->collect(id).value(), Collected::live);
  EXPECT_EQ(listed(), std::vector<std::string>{"m"});
  expect_readable(id, mesh);
  EXPECT_EQ(store_->collect(id + 1).value(), Collected::all) << "nothing is left of a mesh that never was";
}

TEST_F(RetirementTest, IdsAreNeverReused) {
  const MeshId id = put("m", fake_mesh(6, {1}));
  ASSERT_TRUE(store_->remove("m").ok());
  ASSERT_EQ(store_->collect(id).value(), Collected::all);
  EXPECT_EQ(packets(), 0);
  EXPECT_GT(put("m", fake_mesh(6, {1})), id);
}

TEST_F(RetirementTest, FindsByGenerationTheNewestLiveElseTheNewestRetired) {
  const FakeMesh mesh = fake_mesh(8, {30, 40});
  const std::uint64_t generation = mesh.directory.generation;
  EXPECT_EQ(store_->find_generation(0x1234).error().detail, "no mesh has the generation 0000000000001234");
  const MeshId a = put("a", mesh);
  const MeshId b = put("b", mesh);
  put("c", fake_mesh(9, {1}));
  EXPECT_EQ(store_->find_generation(generation).value().summary.id, b);
  ASSERT_TRUE(store_->remove("b").ok());
  EXPECT_EQ(store_->find_generation(generation).value().summary.id, a) << "a live one goes before a retired one";
  ASSERT_TRUE(store_->remove("a").ok());
  const auto found = store_->find_generation(generation);
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found.value().summary.id, b);
  EXPECT_EQ(found.value().levels.size(), 2U);
  EXPECT_EQ(found.value().levels[1].crc32c, mesh.directory.levels[1].crc32c);
  ASSERT_EQ(store_->collect(b).value(), Collected::all);
  ASSERT_EQ(store_->collect(a).value(), Collected::all);
  EXPECT_EQ(outcome(store_->find_generation(generation)), "unknown_mesh");
}

TEST_F(RetirementTest, ABigMeshIsCollectedInSteps) {
  constexpr std::size_t kThird = kCollectBytes / 3;
  const FakeMesh mesh = fake_mesh(10, {kThird, kThird, kThird, kThird, kThird, 10});
  const MeshId id = put("m", mesh);
  ASSERT_TRUE(store_->remove("m").ok());
  EXPECT_EQ(store_->collect(id).value(), Collected::part);
  EXPECT_EQ(packets(), 3) << "the last packets first, not more than a step's bytes";
  // As a kill between two steps leaves it: still retired, nobody is given a mesh with holes.
  reopen();
  EXPECT_EQ(store_->retired().value(), std::vector<MeshId>{id});
  EXPECT_EQ(outcome(store_->find_generation(mesh.directory.generation)), "unknown_mesh");
  EXPECT_EQ(outcome(store_->read_packet(id, 5)), "unknown_mesh");
  EXPECT_EQ(store_->collect(id).value(), Collected::part);
  EXPECT_EQ(packets(), 1);
  EXPECT_EQ(store_->collect(id).value(), Collected::all);
  EXPECT_EQ(packets(), 0);
  EXPECT_EQ(Db(path_).number("SELECT count(*) FROM mesh"), 0);
}

TEST_F(RetirementTest, APacketOverAStepsBytesIsCollectedToo) {
  const MeshId id = put("m", fake_mesh(11, {10, kCollectBytes + 10, kCollectBytes + 10}));
  ASSERT_TRUE(store_->remove("m").ok());
  EXPECT_EQ(store_->collect(id).value(), Collected::part);
  EXPECT_EQ(packets(), 2);
  EXPECT_EQ(store_->collect(id).value(), Collected::part);
  EXPECT_EQ(packets(), 1);
  EXPECT_EQ(store_->collect(id).value(), Collected::all);
}

TEST_F(RetirementTest, CollectingWritesNoLogOfTheMeshsSize) {
  const MeshId id = put("m", fake_mesh(12, {4'000'000}));
  Db(path_).execute("PRAGMA wal_checkpoint(TRUNCATE)");
  ASSERT_TRUE(store_->remove("m").ok());
  ASSERT_EQ(store_->collect(id).value(), Collected::all);
  EXPECT_LT(std::filesystem::file_size(path_ + "-wal"), 400'000U);
}

}  // namespace
}  // namespace pmcd::store
