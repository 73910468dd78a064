// SPDX-License-Identifier: MIT
// The steps in SQL, as SQLite's documentation of ALTER TABLE advises: make the new table, copy, drop the old one,
// rename.
#include "daemon/store/migrate.h"

namespace pmcd::store {
namespace {

// Version 2: a mesh may be retired, so its name is unique among the living only. Ids go on where version 1 was; they
// stand in sqlite_sequence, whose row follows the table when that is renamed.
constexpr const char* kTo2 = R"sql(
CREATE TABLE mesh_2 (
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
  bytes          INTEGER NOT NULL
) STRICT;
INSERT INTO sqlite_sequence (name, seq) SELECT 'mesh_2', seq FROM sqlite_sequence WHERE name = 'mesh';
INSERT INTO mesh_2 (id, name, added_at, generation, format_version, lossless, scalar, lattice_bits, lattice_x, lattice_y,
                    lattice_z, lattice_step, box_min_x, box_min_y, box_min_z, box_max_x, box_max_y, box_max_z, vertices,
                    faces, packets, bytes)
  SELECT id, name, added_at, generation, format_version, lossless, scalar, lattice_bits, lattice_x, lattice_y,
         lattice_z, lattice_step, box_min_x, box_min_y, box_min_z, box_max_x, box_max_y, box_max_z, vertices,
         faces, packets, bytes FROM mesh;
DROP TABLE mesh;
ALTER TABLE mesh_2 RENAME TO mesh;
CREATE UNIQUE INDEX mesh_name ON mesh (name) WHERE retired_at IS NULL;
CREATE INDEX mesh_generation ON mesh (generation);
)sql";

// Version 3: the level directory as it came, which says more than the columns do.
constexpr const char* kTo3 = "ALTER TABLE mesh ADD COLUMN directory BLOB";

// Version 4: the history of the distribution rule's live changes.
constexpr const char* kTo4 = R"sql(
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

}  // namespace

void migrate(Db& db, std::int64_t version) {
  if (version < 2) db.execute(kTo2);
  if (version < 3) db.execute(kTo3);
  if (version < 4) db.execute(kTo4);
  Statement broken(db, "PRAGMA foreign_key_check");
  if (broken.step()) throw SqliteError(SQLITE_CORRUPT, "a packet belongs to no mesh");
}

}  // namespace pmcd::store
