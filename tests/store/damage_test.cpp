// SPDX-License-Identifier: MIT
// Databases that are damaged: what is wrong is named, what is whole is still given, nothing crashes.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "daemon/store/mesh_store.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/mesh_store_fixture.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

using test::fake_mesh;
using test::FakeMesh;

using DamagedStoreTest = MeshStoreFixture;

/// Breaks the header of a page, counted from 1 as SQLite does, in a file that nobody has open.
void damage_page(const std::string& path, std::int64_t page) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp((page - 1) * 4096);
  file.write("\xff\xff\xff\xff", 4);
}

/// Every page but the first, which says what the file is.
void damage_pages(const std::string& path) {
  const std::int64_t pages = Db(path).number("PRAGMA page_count");
  for (std::int64_t page = 2; page <= pages; ++page) damage_page(path, page);
}

TEST_F(DamagedStoreTest, DamageInTheDatabaseIsNamed) {
  const FakeMesh mesh = fake_mesh(12, {20, 30, 40});
  ASSERT_TRUE(insert("m", mesh).ok());
  const auto id = store_->find("m").value().summary.id;
  Db db(path_);
  db.execute("UPDATE packet SET data = zeroblob(78) WHERE level = 1");
  EXPECT_EQ(outcome(store_->read_packet(id, 1)), "database_corrupt");
  EXPECT_EQ(store_->read_packet(id, 2).value(), mesh.packets[2]);
  db.execute("DELETE FROM packet WHERE level = 1");
  EXPECT_EQ(outcome(store_->find("m")), "missing_packet");
  const auto missing = store_->read_packet(id, 1);
  ASSERT_EQ(outcome(missing), "missing_packet");
  EXPECT_EQ(missing.error().detail, "packet 1 of mesh 1 is missing in the database");
  EXPECT_EQ(store_->read_packet(id, 2).value(), mesh.packets[2]);
}

TEST_F(DamagedStoreTest, DamagedRowIsListedApartAndCanBeReplacedAndRemoved) {
  for (const char* name : {"a", "b", "c", "d"}) ASSERT_TRUE(insert(name, fake_mesh(12, {20, 30, 40})).ok());
  Db db(path_);
  db.execute("UPDATE mesh SET vertices = -1 WHERE name IN ('b', 'd')");
  const MeshList list = store_->list().value();
  EXPECT_EQ(names(list), (std::vector<std::string>{"a", "c"}));
  ASSERT_EQ(list.damaged.size(), 2U);
  EXPECT_EQ(list.damaged[0].name, "b");
  EXPECT_EQ(list.damaged[0].error.code, ErrorCode::database_corrupt);
  EXPECT_EQ(list.damaged[0].error.detail, "the database is damaged: vertices is out of range in the database");
  EXPECT_EQ(list.damaged[1].name, "d");
  EXPECT_EQ(outcome(store_->find("b")), "database_corrupt");
  expect_equal("a", fake_mesh(12, {20, 30, 40}));

  ASSERT_TRUE(insert("b", fake_mesh(13, {50}), true).ok());
  expect_equal("b", fake_mesh(13, {50}));
  ASSERT_TRUE(store_->remove("d").ok());
  EXPECT_EQ(names(store_->list().value()), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_TRUE(store_->list().value().damaged.empty());
}

TEST_F(DamagedStoreTest, DamagedPageOfTheMeshTableCostsItsOwnMeshesOnly) {
  std::vector<std::string> all;
  for (int i = 100; i < 200; ++i) {
    all.push_back("mesh" + std::to_string(i));
    ASSERT_TRUE(insert(all.back(), fake_mesh(static_cast<std::uint64_t>(i), {5})).ok());
  }
  Db(path_).execute("PRAGMA wal_checkpoint(TRUNCATE)");
  const std::int64_t page = Db(path_).number(
      "SELECT pageno FROM dbstat WHERE name = 'mesh' AND pagetype = 'leaf' ORDER BY pageno LIMIT 1 OFFSET 1");
  ASSERT_GT(page, 1);
  store_.reset();
  damage_page(path_, page);
  reopen();
  const MeshList list = store_->list().value();
  EXPECT_GE(list.damaged.size(), 10U);
  EXPECT_GE(list.meshes.size(), 50U);
  std::vector<std::string> both = names(list);
  for (const DamagedMesh& mesh : list.damaged) {
    EXPECT_EQ(outcome(store_->find(mesh.name)), "database_corrupt") << mesh.name;
    both.push_back(mesh.name);
  }
  std::sort(both.begin(), both.end());
  EXPECT_EQ(both, all);
  const std::string& whole = list.meshes.back().name;
  expect_equal(whole, fake_mesh(std::stoull(whole.substr(4)), {5}));
}

TEST_F(DamagedStoreTest, DamagedPagesAreNamedAndNothingCrashes) {
  ASSERT_TRUE(insert("m", fake_mesh(12, {20, 30'000, 40})).ok());
  const auto id = store_->find("m").value().summary.id;
  Db(path_).execute("PRAGMA wal_checkpoint(TRUNCATE)");
  store_.reset();
  damage_pages(path_);
  auto opened = MeshStore::open(path_);
  if (opened.ok()) {
    store_ = std::move(opened).value();
    ASSERT_EQ(outcome(store_->list()), "database_corrupt");
    EXPECT_EQ(outcome(store_->find("m")), "database_corrupt");
    EXPECT_EQ(outcome(store_->read_packet(id, 1)), "database_corrupt");
    EXPECT_EQ(outcome(insert("n", fake_mesh(1, {1}))), "database_corrupt");
    EXPECT_EQ(store_->list().error().detail, "the database is damaged: database disk image is malformed");
  } else {
    EXPECT_EQ(outcome(opened), "database_corrupt");
  }
}

}  // namespace
}  // namespace pmcd::store
