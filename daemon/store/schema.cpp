// SPDX-License-Identifier: MIT
// The SQL of the tables, and who may open them.
#include "daemon/store/schema.h"

#include <string>

namespace pmcd::store {
namespace {

// Ids are never reused (AUTOINCREMENT): an id that a session holds means this very mesh or nothing.
// 64-bit unsigned numbers (generation) stand as the signed number of the same bits. The blob is the last column, so
// that reading a directory does not touch the pages of the blobs.
constexpr const char* kTables = R"sql(
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
)sql";

void create(Db& db) {
  Transaction transaction(db);
  db.execute(kTables);
  db.execute(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
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
  if (!fresh && version != kSchemaVersion) {
    return Error{ErrorCode::not_a_database,
                 "the database has schema version " + std::to_string(version) + ", which no pmcd ever wrote"};
  }
  if (db.text("PRAGMA journal_mode = WAL") != "wal") {
    return Error{ErrorCode::database_failed, "the file system of the database does not support write-ahead logging"};
  }
  db.execute(
      "PRAGMA synchronous = FULL;"
      "PRAGMA foreign_keys = ON;"
      "PRAGMA journal_size_limit = 67108864;");
  if (fresh) create(db);
  return Done{};
}

}  // namespace pmcd::store
