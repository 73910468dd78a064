// SPDX-License-Identifier: MIT
// Errors of the store as values: what is wrong with the database or with what was handed in. SQLite's own
// exceptions (db.h) never leave this room.
#pragma once

#include <cstdint>
#include <string>

#include "codec/result.h"

namespace pmcd::store {

enum class ErrorCode : std::uint8_t {
  unknown_mesh,      ///< no mesh has this name, or this mesh is gone
  unknown_packet,    ///< the mesh has no packet of this number
  unknown_change,    ///< there is no rule change of this number, or not any more
  name_taken,        ///< a mesh of this name exists and replacing was not asked for
  bad_name,          ///< empty or too long
  bad_directory,     ///< the level directory is damaged or contradicts itself
  bad_packet,        ///< a packet is damaged, out of order, of another mesh, or not as the directory says
  incomplete,        ///< the upload has a gap or ends before its last packet
  version_changed,   ///< the rule was changed since the caller looked
  too_large,         ///< the upload, one packet or a rule's text is over a limit
  no_space,          ///< the disk is full
  out_of_memory,     ///< the daemon may not take the memory that this needs
  database_newer,    ///< written by a newer pmcd
  not_a_database,    ///< the file is no database, or not one of pmcd
  database_corrupt,  ///< the database is damaged or contradicts itself
  missing_packet,    ///< the database lacks a packet that its mesh should have
  database_locked,   ///< another process holds it
  database_failed,   ///< any other error of SQLite or of the file system
};

/// The stable name of a code, for instance "name_taken". Never null.
const char* error_name(ErrorCode code);

struct Error {
  ErrorCode code = ErrorCode::database_failed;
  std::string detail;  ///< one sentence in plain words
};

template <typename T>
using Result = codec::Result<T, Error>;

/// Success without a value.
struct Done {};
using Status = Result<Done>;

}  // namespace pmcd::store
