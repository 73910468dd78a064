// SPDX-License-Identifier: MIT
// Databases of older versions: opened with all that is in them, or left as they were.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "daemon/store/db.h"
#include "daemon/store/mesh_store.h"
#include "daemon/store/schema.h"
#include "tests/store/fake_mesh.h"
#include "tests/store/outcome.h"

namespace pmcd::store {
namespace {

using test::fake_mesh;
using test::FakeMesh;

// The tables as version 1 made them. History, like what such a database holds: never changed.
constexpr const char* kTables1 = R"sql(
CREATE TABLE mesh (
  id             INTEGER PRIMARY KEY AUTOINCREMENT,
  name           TEXT    NOT NULL UNIQUE,
  added_at       INTEGER NOT NULL,
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
  bytes          INTEGER NOT NULL
) STRICT;
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
PRAGMA user_version = 1;
)sql";

/// Whole numbers for every column but the name, the id and the generation: 2 to 22 in their order.
void insert_1(Db& db, MeshId id, const std::string& name, const FakeMesh& mesh) {
  Statement row(db,
                "INSERT INTO mesh VALUES (?1,?2,1700000000,?3,?4,1,0,14,-1.5,0.25,3,0.5,-1.5,0.25,3,2.5,1.75,4.125,"
                "?5,?6,?7,?8)");
  std::int64_t bytes = 0;
  for (const auto& packet : mesh.packets) bytes += static_cast<std::int64_t>(packet.size());
  const codec::LevelEntry& last = mesh.directory.levels.back();
  row.bind(1, id).bind(2, std::string_view(name)).bind(3, static_cast<std::int64_t>(mesh.directory.generation));
  row.bind(4, std::int64_t{mesh.directory.format_version}).bind(5, std::int64_t{last.vertices});
  row.bind(6, std::int64_t{last.faces}).bind(7, static_cast<std::int64_t>(mesh.packets.size())).bind(8, bytes).run();
  Statement packet(db, "INSERT INTO packet VALUES (NULL,?1,?2,?3,?4,?5,?6,0.25,NULL,?7)");
  for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
    const codec::LevelEntry& entry = mesh.directory.levels[level];
    packet.bind(1, id).bind(2, static_cast<std::int64_t>(level)).bind(3, std::int64_t{entry.bytes});
    packet.bind(4, std::int64_t{entry.vertices}).bind(5, std::int64_t{entry.faces});
    packet.bind(6, std::int64_t{entry.crc32c}).bind(7, std::span<const std::byte>(mesh.packets[level])).run();
  }
}

class Migration : public ::testing::Test {
 protected:
  /// A database of version 1 with two meshes, in which a third, with id 9, was deleted.
  void make_1() {
    Db db(path_);
    db.execute("PRAGMA journal_mode = WAL; PRAGMA foreign_keys = ON");
    db.execute(kTables1);
    insert_1(db, 3, "bunny", bunny_);
    insert_1(db, 5, "horse", horse_);
    insert_1(db, 9, "gone", fake_mesh(3, {10}));
    db.execute("DELETE FROM mesh WHERE id = 9");
  }

  static void expect_holds(MeshStore& store, MeshId id, const std::string& name, const FakeMesh& mesh) {
    const auto found = store.find(name);
    ASSERT_TRUE(found.ok()) << found.error().detail;
    const MeshSummary& summary = found.value().summary;
    EXPECT_EQ(summary.id, id);
    EXPECT_EQ(summary.added_at, 1'700'000'000);
    EXPECT_EQ(summary.generation, mesh.directory.generation);
    EXPECT_TRUE(summary.lossless);
    EXPECT_EQ(summary.lattice.scalar, codec::Scalar::float32);
    EXPECT_EQ(summary.lattice.bits, 14U);
    EXPECT_EQ(summary.lattice.min, (codec::Position{-1.5, 0.25, 3}));
    EXPECT_EQ(summary.lattice.step, 0.5);
    EXPECT_EQ(summary.box_min, mesh.directory.box_min);
    EXPECT_EQ(summary.box_max, mesh.directory.box_max);
    EXPECT_EQ(summary.packets, mesh.packets.size());
    ASSERT_EQ(found.value().levels.size(), mesh.packets.size());
    for (std::size_t level = 0; level < mesh.packets.size(); ++level) {
      EXPECT_EQ(found.value().levels[level].error_rms, 0.25);
      EXPECT_EQ(found.value().levels[level].error_max, -1);
      EXPECT_EQ(found.value().levels[level].bits, 14);
      EXPECT_EQ(store.read_packet(id, static_cast<std::uint32_t>(level)).value(), mesh.packets[level]);
    }
  }

  void expect_migrated() {
    auto opened = MeshStore::open(path_);
    ASSERT_TRUE(opened.ok()) << opened.error().detail;
    expect_holds(*opened.value(), 3, "bunny", bunny_);
    expect_holds(*opened.value(), 5, "horse", horse_);
    EXPECT_EQ(opened.value()->list().value().meshes.size(), 2U);
    EXPECT_TRUE(opened.value()->retired().value().empty());
    EXPECT_EQ(Db(path_).number("PRAGMA user_version"), kSchemaVersion);
    EXPECT_EQ(Db(path_).text("PRAGMA integrity_check"), "ok");
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_.file("meshes.db");
  FakeMesh bunny_ = fake_mesh(1, {100, 0, 50'000});
  FakeMesh horse_ = fake_mesh(2, {7});
};

TEST_F(Migration, KeepsEveryMeshAndId) {
  make_1();
  expect_migrated();
  expect_migrated();  // and it is done once
}

TEST_F(Migration, IdsGoOnWhereTheyWere) {
  make_1();
  const auto store = MeshStore::open(path_).value();
  const FakeMesh mesh = fake_mesh(4, {20});
  const auto spans = mesh.spans();
  const auto replaced = store->insert({"bunny", true, mesh.directory, spans});
  ASSERT_TRUE(replaced.ok()) << replaced.error().detail;
  EXPECT_EQ(replaced.value().mesh.id, 10) << "9 was given out before, although it is not there any more";
  EXPECT_EQ(replaced.value().retired, 3);
  EXPECT_EQ(store->read_packet(3, 2).value(), bunny_.packets[2]);
  EXPECT_EQ(store->collect(3).value(), Collected::all);
  EXPECT_EQ(Db(path_).number("SELECT count(*) FROM packet WHERE mesh = 3"), 0) << "packets still follow their mesh";
}

TEST_F(Migration, AnEmptyDatabaseToo) {
  { Db(path_).execute(kTables1); }
  EXPECT_TRUE(MeshStore::open(path_).value()->list().value().meshes.empty());
}

TEST_F(Migration, MakesTheTablesOfANewDatabase) {
  make_1();
  ASSERT_TRUE(MeshStore::open(path_).ok());
  const std::string fresh = folder_.file("fresh.db");
  ASSERT_TRUE(MeshStore::open(fresh).ok());
  const char* const columns =
      "SELECT group_concat(line) FROM (SELECT m.name || '.' || c.name || ' ' || c.type || c.\"notnull\" || c.pk || "
      "ifnull(c.dflt_value, '') AS line FROM sqlite_master AS m, pragma_table_info(m.name) AS c "
      "WHERE m.type = 'table' ORDER BY m.name, c.cid)";
  const char* const indexes =
      "SELECT group_concat(name || ifnull(sql, '')) FROM (SELECT * FROM sqlite_master WHERE type = 'index' ORDER BY "
      "name)";
  EXPECT_EQ(Db(path_).text(columns), Db(fresh).text(columns));
  EXPECT_EQ(Db(path_).text(indexes), Db(fresh).text(indexes));
}

TEST_F(Migration, ThatFailsLeavesTheOldDatabase) {
  make_1();
  Db(path_).execute("INSERT INTO packet VALUES (NULL, 77, 0, 1, 1, 1, 1, NULL, NULL, x'00')");
  const auto refused = MeshStore::open(path_);
  ASSERT_EQ(outcome(refused), "database_corrupt");
  EXPECT_EQ(refused.error().detail, "the database is damaged: a packet belongs to no mesh");
  {
    Db db(path_);
    EXPECT_EQ(db.number("PRAGMA user_version"), 1);
    EXPECT_EQ(db.number("SELECT count(*) FROM sqlite_master WHERE name = 'mesh_2'"), 0);
    db.execute("DELETE FROM packet WHERE mesh = 77");
  }
  expect_migrated();
}

TEST_F(Migration, WaitsForNobodyForEver) {
  make_1();
  Db other(path_);
  const Transaction writing(other);
  EXPECT_EQ(outcome(MeshStore::open(path_)), "database_locked");
}

/// Opens the database in a process that the kernel kills at the first write beyond `bytes` of a file. Whether it was.
bool killed_at(const std::string& path, rlim_t bytes) {
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit none{0, 0};
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_CORE, &none);
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_DFL);
    ::_exit(MeshStore::open(path).ok() ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status) || (WIFEXITED(status) && WEXITSTATUS(status) == 0)) << status;
  return WIFSIGNALED(status);
}

TEST_F(Migration, KilledAtAnyWriteIsWholeOrNotAtAll) {
  int kills = 0;
  for (std::uintmax_t beyond = 0;; beyond += 2048) {
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(path_ + end);
    make_1();
    {
      // The -shm file has 32 KiB. A limit hits the log only if that is longer, so something is in it already.
      Db db(path_);
      ASSERT_EQ(sqlite3_db_config(db.handle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr), SQLITE_OK);
      db.execute("CREATE TABLE filler (x); INSERT INTO filler VALUES (zeroblob(40000)); DROP TABLE filler");
    }
    const bool killed = killed_at(path_, std::filesystem::file_size(path_ + "-wal") + beyond);
    {
      Db db(path_);
      const std::int64_t version = db.number("PRAGMA user_version");
      const std::int64_t steps = db.number(
          "SELECT (SELECT count(*) FROM pragma_table_info('mesh') WHERE name IN ('retired_at', 'directory')) + "
          "(SELECT count(*) FROM sqlite_master WHERE name = 'rule_change')");
      EXPECT_EQ(steps, version - 1);
    }
    expect_migrated();
    if (!killed) break;
    ++kills;
  }
  EXPECT_GT(kills, 5);
}

}  // namespace
}  // namespace pmcd::store
