// SPDX-License-Identifier: MIT
// The tables of the mesh database and their version, which stands in PRAGMA user_version. It reads and writes no
// meshes.
#pragma once

#include <cstdint>

#include "daemon/store/db.h"

namespace pmcd::store {

/// Raised whenever a table changes; an older database is brought up to date when it is opened, a newer one is refused.
inline constexpr std::int64_t kSchemaVersion = 4;

/// Marks a file as pmcd's ("PMCD"); part of the database format, never changed.
inline constexpr std::int64_t kApplicationId = 0x504d4344;

/// Makes the tables in an empty database, brings those of an older one up to date, refuses a newer one, and sets what a
/// connection needs (WAL, synchronous=FULL, foreign keys). What it changes, it changes in one transaction.
/// Errors: database_newer, not_a_database. Also throws SqliteError.
Status prepare_database(Db& db);

}  // namespace pmcd::store
