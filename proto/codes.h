// SPDX-License-Identifier: MIT
// The one table of error codes on the wire: number, name, what it ends, and a sentence. docs/PROTOCOL.md repeats it and
// a test compares the two. Request, data and admin channels share the numbers.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace pmcd::proto {

// Part of the protocol: never change or reuse a number. The range tells what a code ends, so a client knows what to do
// with a code that a later minor version added: 1-31 the session, 32-63 the request, 64-95 the mesh (its handle),
// 128-159 the admin request. 0 is no error.
enum class ErrorCode : std::uint16_t {
  none = 0,
  unsupported_version = 1,
  bad_magic = 2,
  frame_too_long = 3,
  malformed = 4,
  wrong_state = 5,
  bad_token = 6,
  hello_timeout = 7,
  join_timeout = 8,
  duplicate_id = 9,
  too_many_sessions = 10,
  shutting_down = 11,
  stalled = 12,
  channel_lost = 13,
  unknown_type = 32,
  not_joined = 33,
  too_many_requests = 34,
  unknown_mesh = 35,
  unknown_handle = 36,
  bad_name = 37,
  internal_error = 38,
  bad_range = 39,
  unavailable = 64,
  mesh_changed = 65,
  mesh_exists = 128,
  bad_directory = 129,
  bad_packet = 130,
  ingest_incomplete = 131,
  too_large = 132,
  storage_failed = 133,
  bad_rule = 134,
  bad_option = 135,
  version_changed = 136,
  unknown_client = 137,
  unknown_change = 138,
};

/// What a code ends. `session`: both channels are closed behind it (or the connection that has no session yet).
/// `request`: that request alone. `mesh`: the request, and the mesh's handle is of no use any more.
enum class Ends : std::uint8_t { session, request, mesh };

struct CodeInfo {
  ErrorCode code;
  std::string_view name;  ///< as written in this file, in logs and in JSON
  Ends ends;
  std::string_view sentence;  ///< what happened, for people
};

/// All codes but `none`, ascending by number.
std::span<const CodeInfo> all_codes();

/// The table's line, or nullptr for a number that is not in it.
const CodeInfo* find_code(std::uint16_t number);

/// The stable name, "none" for 0, "unknown_code" for a number that is not in the table.
std::string_view code_name(ErrorCode code);

/// What a code ends, by the table or, for a number that is not in it, by its range (numbers outside all ranges end the
/// session).
Ends code_ends(ErrorCode code);

/// "session", "request" or "mesh".
std::string_view ends_name(Ends ends);

}  // namespace pmcd::proto
