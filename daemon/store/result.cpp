// SPDX-License-Identifier: MIT
// The names of the store's errors.
#include "daemon/store/result.h"

namespace pmcd::store {

const char* error_name(ErrorCode code) {
  switch (code) {
    case ErrorCode::unknown_mesh:
      return "unknown_mesh";
    case ErrorCode::unknown_packet:
      return "unknown_packet";
    case ErrorCode::unknown_change:
      return "unknown_change";
    case ErrorCode::name_taken:
      return "name_taken";
    case ErrorCode::bad_name:
      return "bad_name";
    case ErrorCode::bad_directory:
      return "bad_directory";
    case ErrorCode::bad_packet:
      return "bad_packet";
    case ErrorCode::incomplete:
      return "incomplete";
    case ErrorCode::version_changed:
      return "version_changed";
    case ErrorCode::too_large:
      return "too_large";
    case ErrorCode::no_space:
      return "no_space";
    case ErrorCode::out_of_memory:
      return "out_of_memory";
    case ErrorCode::database_newer:
      return "database_newer";
    case ErrorCode::not_a_database:
      return "not_a_database";
    case ErrorCode::database_corrupt:
      return "database_corrupt";
    case ErrorCode::missing_packet:
      return "missing_packet";
    case ErrorCode::database_locked:
      return "database_locked";
    case ErrorCode::database_failed:
      return "database_failed";
  }
  return "unknown";
}

}  // namespace pmcd::store
