// SPDX-License-Identifier: MIT
// The way from an older database to today's tables, one step a version. A step is history: it is never changed, however
// the tables go on. It decides nothing about newer databases (schema.h does).
#pragma once

#include <cstdint>

#include "daemon/store/db.h"

namespace pmcd::store {

/// Changes the tables of schema `version` into those of kSchemaVersion. Packets are neither copied nor read.
/// REQUIRES: 1 <= version <= kSchemaVersion, a transaction is open, foreign keys are off. Throws SqliteError; the
/// transaction must be rolled back then.
void migrate(Db& db, std::int64_t version);

}  // namespace pmcd::store
