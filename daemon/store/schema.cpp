// SPDX-License-Identifier: MIT
// The SQL of the tables, and who may open them.
#include "daemon/store/schema.h"

#include <string>

#include "daemon/store/migrate.h"

namespace pmcd::store {
namespace {

// Ids are never reused (AUTOINCREMENT): an id that a session holds means this very mesh or nothing.
// 64-bit unsigned numbers (generation) stand as the signed number of the same bits. The blob is the last column, so
// that reading a directory does not touch the pages of the blobs.
// A mesh with retired_at (seconds since 1970) was replaced or removed: it has no name any more as far as others see,
// and its packets stay until it is collected. collecting = 1: the deletion has begun, packets may be missing.
// The level directory stands as it came, for what the columns do not tell; NULL in meshes of version 2.
// A rule_change is one live change of the distribution rule; its id is the policy's version from then on, so it is
// never reused either. rule NULL: no live rule any more, the configuration decides. reverts: the id of the change that
// this one went back to, which may have been deleted since. Whatever changes here needs a step in migrate.cpp and
// another kSchemaVersion.
constexpr const char* kTables = R"sql(
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
CREATE TABLE rule_change (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  changed_at INTEGER NOT NULL,
  rule       TEXT,
  options    TEXT    NOT NULL,
  uid        INTEGER NOT NULL,
  pid        INTEGER NOT NULL,
  reverts    INTEGER
) STRICT;
)sql";

/// Makes the tables or brings older ones up to date, in one transaction. Looks at the version again: another process
/// may have been faster.
void bring_up_to_date(Db& db) {
  Transaction transaction(db);
  const std::int64_t version = db.number("PRAGMA user_version");
  if (version == 0) {
    db.execute(kTables);
    db.execute(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
  } else {
    migrate(db, version);
  }
  db.execute(("PRAGMA user_version = " + std::to_string(kSchemaVersion)).c_str());
  transaction.commit();
}

}  // namespace

Status prepare_database(Db& db) {
  const std::int64_t application = db.number("PRAGMA application_id");
  const std::int64_t version = db.number("PRAGMA user_version");
  const bool empty = db.number("SELECT count(*) FROM sqlite_master") == 0;
  const bool fresh = empty && application == 0 && version == 0;
  if (!fresh && application != kApplicationId) {
    return Error{ErrorCode::not_a_database, "the file is an SQLite database, but not one of pmcd"};
  }
  if (version > kSchemaVersion) {
    return Error{ErrorCode::database_newer, "the database has schema version " + std::to_string(version) +
                                                ", this pmcd knows versions up to " + std::to_string(kSchemaVersion)};
  }
  if (!fresh && version < 1) {
    return Error{ErrorCode::not_a_database,
                 "the database has schema version " + std::to_string(version) + ", which no pmcd ever wrote"};
  }
  if (db.text("PRAGMA journal_mode = WAL") != "wal") {
    return Error{ErrorCode::database_failed, "the file system of the database does not support write-ahead logging"};
  }
  // Debian's SQLite would overwrite each deleted byte with zeros: a log as large as the mesh that is deleted, for data
  // that every client may fetch. Foreign keys stay off while tables are rebuilt.
  db.execute(
      "PRAGMA synchronous = FULL;"
      "PRAGMA secure_delete = FAST;"
      "PRAGMA foreign_keys = OFF;"
      "PRAGMA journal_size_limit = 67108864;");
  if (version != kSchemaVersion) bring_up_to_date(db);
  db.execute("PRAGMA foreign_keys = ON");
  return Done{};
}

}  // namespace pmcd::store
