// SPDX-License-Identifier: MIT
// Databases of version 3, the last that knew no rule changes: opened with all that is in them. What comes from before
// that, and a step that is cut off, is in migration_test.cpp.
#include <gtest/gtest.h>

#include "daemon/store/db.h"
#include "daemon/store/mesh_store.h"
#include "daemon/store/schema.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

using test::fake_mesh;
using test::FakeMesh;

// The tables as version 3 made them. History, like what such a database holds: never changed.
constexpr const char* kTables3 = R"sql(
CREATE TABLE mesh (
  id             INTEGER PRIMARY KEY AUTOINCREMENT,
  name           TEXT    NOT NULL,
  added_at       INTEGER NOT NULL,
  retired_at     INTEGER,
  collecting     INTEGER NOT NULL DEFAULT 0,
  generation     INTEGER NOT NULL,
  format_version INTEGER NOT NULL,
  lossless       INTEGER NOT NULL,
  scalar         INTEGER NOT NULL,
  lattice_bits   INTEGER NOT NULL,
  lattice_x      REAL    NOT NULL,
  lattice_y      REAL    NOT NULL,
  lattice_z      REAL    NOT NULL,
  lattice_step   REAL    NOT NULL,
  box_min_x      REAL    NOT NULL,
  box_min_y      REAL    NOT NULL,
  box_min_z      REAL    NOT NULL,
  box_max_x      REAL    NOT NULL,
  box_max_y      REAL    NOT NULL,
  box_max_z      REAL    NOT NULL,
  vertices       INTEGER NOT NULL,
  faces          INTEGER NOT NULL,
  packets        INTEGER NOT NULL,
  bytes          INTEGER NOT NULL,
  directory      BLOB
) STRICT;
CREATE UNIQUE INDEX mesh_name ON mesh (name) WHERE retired_at IS NULL;
CREATE INDEX mesh_generation ON mesh (generation);
CREATE TABLE packet (
  id        INTEGER PRIMARY KEY,
  mesh      INTEGER NOT NULL REFERENCES mesh(id) ON DELETE CASCADE,
  level     INTEGER NOT NULL,
  bytes     INTEGER NOT NULL,
  vertices  INTEGER NOT NULL,
  faces     INTEGER NOT NULL,
  crc32c    INTEGER NOT NULL,
  error_rms REAL,
  error_max REAL,
  data      BLOB    NOT NULL,
  UNIQUE (mesh, level)
) STRICT;
PRAGMA application_id = 0x504d4344;
PRAGMA user_version = 3;
)sql";

void insert_3(Db& db, MeshId id, const std::string& name, const FakeMesh& mesh) {
  Statement row(db,
                "INSERT INTO mesh VALUES (?1,?2,1700000000,NULL,0,?3,?4,1,1,14,-1.5,0.25,3,0.0009765625,-1.5,0.25,3,"
                "2.5,1.75,4.125,?5,?6,?7,?8,?9)");
  std::int64_t bytes = 0;
  for (const auto& packet : mesh.packets) bytes += static_cast<std::int64_t>(packet.size());
  const codec::LevelEntry& last = mesh.directory.levels.back();
  const std::vector<std::byte> directory = mesh.directory_bytes();
  row.bind(1, id).bind(2, std::string_view(name)).bind(3, static_cast<std::int64_t>(mesh.directory.generation));
  row.bind(4, std::int64_t{mesh.directory.format_version}).bind(5, std::int64_t{last.vertices});
  row.bind(6, std::int64_t{last.faces}).bind(7, static_cast<std::int64_t>(mesh.packets.size())).bind(8, bytes);
  row.bind(9, std::span<const std::byte>(directory)).run();
  Statement packet(db, "INSERT INTO packet VALUES (NULL,?1,?2,?3,?4,?5,?6,0.25,NULL,?7)");
  for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
    const codec::LevelEntry& entry = mesh.directory.levels[level];
    packet.bind(1, id).bind(2, static_cast<std::int64_t>(level)).bind(3, std::int64_t{entry.bytes});
    packet.bind(4, std::int64_t{entry.vertices}).bind(5, std::int64_t{entry.faces});
    packet.bind(6, std::int64_t{entry.crc32c}).bind(7, std::span<const std::byte>(mesh.packets[level])).run();
  }
}

class MigrationFrom3 : public ::testing::Test {
 protected:
  /// Two live meshes, 3 and 5, and 8, which was retired; 9 was deleted.
  MigrationFrom3() {
    Db db(path_);
    db.execute("PRAGMA journal_mode = WAL; PRAGMA foreign_keys = ON");
    db.execute(kTables3);
    insert_3(db, 3, "bunny", bunny_);
    insert_3(db, 5, "horse", horse_);
    insert_3(db, 8, "old", old_);
    insert_3(db, 9, "gone", fake_mesh(4, {10}));
    db.execute("UPDATE mesh SET retired_at = 1700000001 WHERE id = 8; DELETE FROM mesh WHERE id = 9");
  }

  static void expect_packets(MeshStore& store, MeshId id, const FakeMesh& mesh) {
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      const auto packet = store.read_packet(id, static_cast<std::uint32_t>(level));
      ASSERT_TRUE(packet.ok()) << packet.error().detail;
      EXPECT_EQ(packet.value(), mesh.packets[level]);
    }
  }

  static void expect_holds(MeshStore& store, MeshId id, const std::string& name, const FakeMesh& mesh) {
    const auto found = store.find(name);
    ASSERT_TRUE(found.ok()) << found.error().detail;
    EXPECT_EQ(found.value().summary.id, id);
    EXPECT_EQ(found.value().summary.added_at, 1'700'000'000);
    EXPECT_EQ(found.value().summary.generation, mesh.directory.generation);
    ASSERT_EQ(found.value().levels.size(), mesh.packets.size());
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      EXPECT_EQ(found.value().levels[level].bits, mesh.directory.levels[level].bits) << "the directory tells it";
    }
    expect_packets(store, id, mesh);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("meshes.db");
  FakeMesh bunny_ = fake_mesh(1, {100, 0, 50'000});
  FakeMesh horse_ = fake_mesh(2, {7});
  FakeMesh old_ = fake_mesh(3, {70, 80});
};

TEST_F(MigrationFrom3, KeepsEveryMeshAlsoTheRetired) {
  for (const char* time : {"migrated", "opened again"}) {
    auto opened = MeshStore::open(path_);
    ASSERT_TRUE(opened.ok()) << opened.error().detail << time;
    MeshStore& store = *opened.value();
    expect_holds(store, 3, "bunny", bunny_);
    expect_holds(store, 5, "horse", horse_);
    EXPECT_EQ(store.list().value().meshes.size(), 2U) << time;
    EXPECT_EQ(store.retired().value(), std::vector<MeshId>{8}) << time;
    expect_packets(store, 8, old_);
    EXPECT_EQ(Db(path_).number("PRAGMA user_version"), kSchemaVersion) << time;
    EXPECT_EQ(Db(path_).text("PRAGMA integrity_check"), "ok") << time;
  }
}

TEST_F(MigrationFrom3, MeshIdsGoOnWhereTheyWere) {
  const auto store = MeshStore::open(path_).value();
  const FakeMesh mesh = fake_mesh(6, {20});
  const auto spans = mesh.spans();
  const auto inserted = store->insert({"new", false, mesh.directory, spans});
  ASSERT_TRUE(inserted.ok()) << inserted.error().detail;
  EXPECT_EQ(inserted.value().mesh.id, 10) << "9 was given out before, although it is not there any more";
}

TEST_F(MigrationFrom3, MakesTheTableOfANewDatabase) {
  ASSERT_TRUE(MeshStore::open(path_).ok());
  const std::string fresh = folder_.file("fresh.db");
  ASSERT_TRUE(MeshStore::open(fresh).ok());
  const char* const table = "SELECT sql FROM sqlite_master WHERE type = 'table' AND name = 'rule_change'";
  const char* const tables = "SELECT group_concat(name || strict) FROM (SELECT * FROM pragma_table_list ORDER BY name)";
  EXPECT_FALSE(Db(path_).text(table).empty());
  EXPECT_EQ(Db(path_).text(table), Db(fresh).text(table));
  EXPECT_EQ(Db(path_).text(tables), Db(fresh).text(tables));
}

TEST_F(MigrationFrom3, ThatFailsLeavesTheOldDatabase) {
  Db(path_).execute("CREATE TABLE rule_change (x)");
  const auto refused = MeshStore::open(path_);
  ASSERT_EQ(outcome(refused), "database_failed");
  EXPECT_EQ(refused.error().detail, "table rule_change already exists");
  {
    Db db(path_);
    EXPECT_EQ(db.number("PRAGMA user_version"), 3);
    db.execute("DROP TABLE rule_change");
  }
  const auto opened = MeshStore::open(path_);
  ASSERT_TRUE(opened.ok()) << opened.error().detail;
  expect_holds(*opened.value(), 3, "bunny", bunny_);
}

}  // namespace
}  // namespace pmcd::store
