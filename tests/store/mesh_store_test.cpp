// SPDX-License-Identifier: MIT
// The mesh database: what goes in comes out, also after a reopening; what is refused leaves no trace.
#include "daemon/store/mesh_store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <fstream>

#include "codec/packet/header.h"
#include "daemon/store/db.h"
#include "daemon/store/schema.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/mesh_store_fixture.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

using test::fake_mesh;
using test::FakeMesh;

using MeshStoreTest = MeshStoreFixture;

TEST_F(MeshStoreTest, KeepsEveryValueAlsoAfterReopening) {
  const FakeMesh bunny = fake_mesh(1, {100, 0, 50'000, 300'000});
  const FakeMesh horse = fake_mesh(2, {7});
  const auto inserted = insert("bunny", bunny);
  ASSERT_TRUE(inserted.ok()) << inserted.error().detail;
  EXPECT_FALSE(inserted.value().replaced());
  EXPECT_EQ(inserted.value().mesh.packets, 4U);
  EXPECT_GT(inserted.value().mesh.added_at, 1'700'000'000);
  ASSERT_TRUE(insert("horse", horse).ok());
  expect_equal("bunny", bunny);
  reopen();
  expect_equal("bunny", bunny);
  expect_equal("horse", horse);
}

TEST_F(MeshStoreTest, KeepsTheUnitOfALattice) {
  FakeMesh mesh = fake_mesh(3, {20, 30});
  mesh.directory.lattice.set_unit({5, -3}, {-700, 12, 0});
  ASSERT_TRUE(insert("part", mesh).ok());
  reopen();
  const auto found = store_->find("part");
  ASSERT_TRUE(found.ok()) << found.error().detail;
  EXPECT_EQ(found.value().summary.lattice.unit, (codec::Unit{5, -3}));
  EXPECT_EQ(found.value().summary.lattice.origin, mesh.directory.lattice.origin);
}

TEST_F(MeshStoreTest, ListsByName) {
  EXPECT_TRUE(store_->list().value().meshes.empty());
  for (const char* name : {"b", "a", "\xc3\xa9", "B"}) ASSERT_TRUE(insert(name, fake_mesh(3, {1, 2})).ok());
  EXPECT_EQ(names(store_->list().value()), (std::vector<std::string>{"B", "a", "b", "\xc3\xa9"}));
}

TEST_F(MeshStoreTest, NameTakenUnlessReplacing) {
  const FakeMesh first = fake_mesh(4, {100, 100});
  const FakeMesh second = fake_mesh(5, {10, 10, 10});
  ASSERT_TRUE(insert("m", first).ok());
  const auto id = store_->find("m").value().summary.id;
  const auto refused = insert("m", second);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(outcome(refused), "name_taken");
  expect_equal("m", first);
  const auto replaced = insert("m", second, true);
  ASSERT_TRUE(replaced.ok());
  EXPECT_EQ(replaced.value().retired, id);
  EXPECT_NE(replaced.value().mesh.id, id);
  expect_equal("m", second);
  EXPECT_EQ(store_->list().value().meshes.size(), 1U);
}

TEST_F(MeshStoreTest, RefusedReplacementKeepsTheOldMesh) {
  const FakeMesh first = fake_mesh(4, {100, 100});
  FakeMesh broken = fake_mesh(5, {10, 10});
  broken.packets[1].back() ^= std::byte{1};
  ASSERT_TRUE(insert("m", first).ok());
  EXPECT_EQ(outcome(insert("m", broken, true)), "bad_packet");
  expect_equal("m", first);
}

TEST_F(MeshStoreTest, UnknownPacket) {
  ASSERT_TRUE(insert("m", fake_mesh(6, {1, 2})).ok());
  const auto id = store_->find("m").value().summary.id;
  EXPECT_EQ(outcome(store_->read_packet(id, 2)), "unknown_packet");
}

TEST_F(MeshStoreTest, RefusesBadNames) {
  for (const std::string& name : {std::string(), std::string(kMaxNameBytes + 1, 'x')}) {
    EXPECT_EQ(outcome(insert(name, fake_mesh(1, {1}))), "bad_name");
  }
  EXPECT_TRUE(insert(std::string(kMaxNameBytes, 'x'), fake_mesh(1, {1})).ok());
}

TEST_F(MeshStoreTest, RefusesDamagedPackets) {
  FakeMesh mesh = fake_mesh(7, {20, 30, 40});
  for (std::size_t at = 0; at < mesh.packets[1].size(); ++at) {
    FakeMesh flipped = mesh;
    flipped.packets[1][at] ^= std::byte{4};
    EXPECT_EQ(refused(flipped), ErrorCode::bad_packet) << "byte " << at;
  }
  FakeMesh cut = mesh;
  cut.packets[2].pop_back();
  EXPECT_EQ(refused(cut), ErrorCode::bad_packet);
  FakeMesh longer = mesh;
  longer.packets[0].push_back(std::byte{0});
  EXPECT_EQ(refused(longer), ErrorCode::bad_packet);
}

TEST_F(MeshStoreTest, RefusesPacketsThatAreNotWhatTheDirectorySays) {
  const FakeMesh mesh = fake_mesh(8, {20, 20, 20});
  FakeMesh swapped = mesh;
  std::swap(swapped.packets[1], swapped.packets[2]);
  EXPECT_EQ(refused(swapped), ErrorCode::bad_packet);
  FakeMesh missing = mesh;
  missing.packets.pop_back();
  EXPECT_EQ(refused(missing), ErrorCode::bad_packet);
  FakeMesh too_many = mesh;
  too_many.packets.push_back(mesh.packets[2]);
  EXPECT_EQ(refused(too_many), ErrorCode::bad_packet);
  FakeMesh truncated = mesh;  // directory and packets agree, but no packet is marked as the last
  truncated.packets.pop_back();
  truncated.directory.levels.pop_back();
  EXPECT_EQ(refused(truncated), ErrorCode::bad_packet);
  FakeMesh of_another = mesh;
  of_another.packets[1] = fake_mesh(9, {20, 20, 20}).packets[1];
  of_another.directory.levels[1].crc32c = codec::parse_packet_header(of_another.packets[1]).value().crc32c;
  EXPECT_EQ(refused(of_another), ErrorCode::bad_packet);
  for (int field = 0; field < 4; ++field) {
    FakeMesh wrong = mesh;
    codec::LevelEntry& entry = wrong.directory.levels[1];
    ++(field == 0 ? entry.bytes : field == 1 ? entry.vertices : field == 2 ? entry.faces : entry.crc32c);
    EXPECT_EQ(refused(wrong), ErrorCode::bad_packet) << "field " << field;
  }
  FakeMesh precision = mesh;
  ++precision.directory.levels[1].bits;
  EXPECT_EQ(refused(precision), ErrorCode::bad_packet);
}

TEST_F(MeshStoreTest, RefusesDirectoriesThatItCannotStore) {
  FakeMesh empty;
  empty.directory.format_version = codec::kFormatVersion;
  EXPECT_EQ(refused(empty), ErrorCode::bad_directory);
  FakeMesh version = fake_mesh(10, {1});
  ++version.directory.format_version;
  EXPECT_EQ(refused(version), ErrorCode::bad_directory);
  EXPECT_EQ(refused(fake_mesh(11, std::vector<std::size_t>(kMaxLevels + 1, 0))), ErrorCode::too_large);
  EXPECT_TRUE(insert("most", fake_mesh(11, std::vector<std::size_t>(kMaxLevels, 0))).ok());
}

TEST_F(MeshStoreTest, WritesAheadAndSyncs) {
  Db db(path_);
  EXPECT_EQ(db.text("PRAGMA journal_mode"), "wal");
  ASSERT_TRUE(prepare_database(db).ok());
  EXPECT_EQ(db.number("PRAGMA synchronous"), 2);
  EXPECT_EQ(db.number("PRAGMA foreign_keys"), 1);
  EXPECT_EQ(db.number("PRAGMA user_version"), kSchemaVersion);
}

TEST_F(MeshStoreTest, LockedDatabaseIsNamedAndRecovers) {
  Db other(path_);
  {
    const Transaction writing(other);
    const auto locked = insert("m", fake_mesh(1, {1}));
    ASSERT_EQ(outcome(locked), "database_locked");
    EXPECT_EQ(locked.error().detail, "another process keeps the database locked: database is locked");
    EXPECT_TRUE(store_->list().ok()) << "readers do not wait for a writer";
  }
  EXPECT_TRUE(insert("m", fake_mesh(1, {1})).ok());
}

TEST_F(MeshStoreTest, WriteThatFailsHalfWayLeavesNothing) {
  ASSERT_TRUE(insert("small", fake_mesh(1, {10})).ok());
  // A limit on file sizes stands in for a full disk.
  auto* const before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small{1'000'000, limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto failed = insert("big", fake_mesh(2, {2'000'000, 2'000'000}));
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, before);
  EXPECT_EQ(outcome(failed), "no_space");
  EXPECT_EQ(store_->list().value().meshes.size(), 1U);
  expect_equal("small", fake_mesh(1, {10}));
  ASSERT_TRUE(insert("big", fake_mesh(2, {2'000'000, 2'000'000})).ok());
  reopen();
  expect_equal("big", fake_mesh(2, {2'000'000, 2'000'000}));
}

TEST(MeshStoreOpen, RefusesNewerSchema) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("meshes.db");
  ASSERT_TRUE(MeshStore::open(path).ok());
  Db(path).execute("PRAGMA user_version = 5");
  const auto opened = MeshStore::open(path);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(outcome(opened), "database_newer");
  EXPECT_EQ(opened.error().detail, "the database has schema version 5, this pmcd knows versions up to 4");
}

TEST(MeshStoreOpen, RefusesFilesOfOthers) {
  const test::TemporaryFolder folder;
  const std::string text = folder.file("text.db");
  std::ofstream(text) << std::string(5000, 'x');
  EXPECT_EQ(outcome(MeshStore::open(text)), "not_a_database");
  const std::string other = folder.file("other.db");
  Db(other).execute("CREATE TABLE t (x)");
  EXPECT_EQ(outcome(MeshStore::open(other)), "not_a_database");
  EXPECT_EQ(Db(other).text("PRAGMA journal_mode"), "delete") << "a database of others is not touched";
  const auto missing = MeshStore::open(folder.file("no/such/folder.db"));
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(outcome(missing), "database_failed");
  EXPECT_NE(missing.error().detail.find("No such file or directory"), std::string::npos);
}

TEST(MeshStoreOpen, MakesAnEmptyDatabaseThatOthersCannotRead) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("meshes.db");
  ASSERT_TRUE(MeshStore::open(path).ok());
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0007U, 0U);
  // An empty file is taken as an empty database.
  const std::string empty = folder.file("empty.db");
  std::ofstream(empty).flush();
  EXPECT_TRUE(MeshStore::open(empty).ok());
}

}  // namespace
}  // namespace pmcd::store
