// SPDX-License-Identifier: MIT
// The table behind codes.h. docs/PROTOCOL.md repeats it; a test compares the two.
#include "proto/codes.h"

#include <algorithm>
#include <array>

namespace pmcd::proto {

namespace {

constexpr std::array kCodes{
    CodeInfo{ErrorCode::unsupported_version, "unsupported_version", Ends::session,
             "The peer speaks another major version of the protocol."},
    CodeInfo{ErrorCode::bad_magic, "bad_magic", Ends::session, "The first frame is not that of a pmcd peer."},
    CodeInfo{ErrorCode::frame_too_long, "frame_too_long", Ends::session,
             "A frame is longer than this direction allows."},
    CodeInfo{ErrorCode::malformed, "malformed", Ends::session, "A frame of known type does not have its form."},
    CodeInfo{ErrorCode::wrong_state, "wrong_state", Ends::session,
             "A frame of known type is not allowed on this channel or not at this moment."},
    CodeInfo{ErrorCode::bad_token, "bad_token", Ends::session,
             "The session token is unknown, was used before or is too old."},
    CodeInfo{ErrorCode::hello_timeout, "hello_timeout", Ends::session,
             "The peer connected and did not say hello in time."},
    CodeInfo{ErrorCode::join_timeout, "join_timeout", Ends::session, "The data channel did not join in time."},
    CodeInfo{ErrorCode::duplicate_id, "duplicate_id", Ends::session, "A request has the id of one that is still open."},
    CodeInfo{ErrorCode::too_many_sessions, "too_many_sessions", Ends::session,
             "The server serves as many sessions as it may; try again later."},
    CodeInfo{ErrorCode::shutting_down, "shutting_down", Ends::session, "The server is ending and takes nothing new."},
    CodeInfo{ErrorCode::stalled, "stalled", Ends::session, "The client took its data too slowly or not at all."},
    CodeInfo{ErrorCode::channel_lost, "channel_lost", Ends::session, "The other channel of the session was lost."},
    CodeInfo{ErrorCode::unknown_type, "unknown_type", Ends::request, "The frame's type is not known to this server."},
    CodeInfo{ErrorCode::not_joined, "not_joined", Ends::request,
             "The request came before the data channel had joined the session."},
    CodeInfo{ErrorCode::too_many_requests, "too_many_requests", Ends::request,
             "The session has as many open requests, or as many open meshes, as it may."},
    CodeInfo{ErrorCode::unknown_mesh, "unknown_mesh", Ends::request, "There is no mesh of that name."},
    CodeInfo{ErrorCode::unknown_handle, "unknown_handle", Ends::request,
             "The handle was not given out in this session."},
    CodeInfo{ErrorCode::bad_name, "bad_name", Ends::request,
             "The name is empty or too long, or holds a slash or what cannot be printed."},
    CodeInfo{ErrorCode::internal_error, "internal_error", Ends::request, "A fault of the server; its log says more."},
    CodeInfo{ErrorCode::bad_range, "bad_range", Ends::request,
             "The packet that was asked for, or the offset in it, lies beyond the end of the mesh."},
    CodeInfo{ErrorCode::unavailable, "unavailable", Ends::mesh, "The stored mesh cannot be read at present."},
    CodeInfo{ErrorCode::mesh_changed, "mesh_changed", Ends::mesh,
             "The mesh was replaced or removed; the generation that was asked for is gone."},
    CodeInfo{ErrorCode::mesh_exists, "mesh_exists", Ends::request,
             "A mesh of that name is stored already and replacing it was not asked for."},
    CodeInfo{ErrorCode::bad_directory, "bad_directory", Ends::request,
             "The level directory of an ingest is not valid."},
    CodeInfo{ErrorCode::bad_packet, "bad_packet", Ends::request,
             "A packet of an ingest is damaged or not the announced one."},
    CodeInfo{ErrorCode::ingest_incomplete, "ingest_incomplete", Ends::request,
             "The data of an ingest has gaps, is out of order or ended too early."},
    CodeInfo{ErrorCode::too_large, "too_large", Ends::request, "The mesh is larger than the daemon takes."},
    CodeInfo{ErrorCode::storage_failed, "storage_failed", Ends::request,
             "The database refused; the text says why, and nothing was changed."},
    CodeInfo{ErrorCode::bad_rule, "bad_rule", Ends::request, "There is no distribution rule of that name."},
    CodeInfo{ErrorCode::bad_option, "bad_option", Ends::request,
             "An option is unknown or not one of the rule's, or its value is not allowed."},
    CodeInfo{ErrorCode::version_changed, "version_changed", Ends::request,
             "Somebody else changed the rule meanwhile; nothing was changed."},
    CodeInfo{ErrorCode::unknown_client, "unknown_client", Ends::request, "There is no session of that number."},
    CodeInfo{ErrorCode::unknown_change, "unknown_change", Ends::request, "The history has no change of that number."},
};

static_assert(std::is_sorted(kCodes.begin(), kCodes.end(),
                             [](const CodeInfo& a, const CodeInfo& b) { return a.code < b.code; }));

}  // namespace

std::span<const CodeInfo> all_codes() {
  return kCodes;
}

const CodeInfo* find_code(std::uint16_t number) {
  const auto* found = std::find_if(kCodes.begin(), kCodes.end(), [number](const CodeInfo& info) {
    return static_cast<std::uint16_t>(info.code) == number;
  });
  return found == kCodes.end() ? nullptr : found;
}

std::string_view code_name(ErrorCode code) {
  if (code == ErrorCode::none) return "none";
  const CodeInfo* info = find_code(static_cast<std::uint16_t>(code));
  return info == nullptr ? "unknown_code" : info->name;
}

Ends code_ends(ErrorCode code) {
  const auto number = static_cast<std::uint16_t>(code);
  if ((number >= 32 && number < 64) || (number >= 128 && number < 160)) return Ends::request;
  if (number >= 64 && number < 96) return Ends::mesh;
  return Ends::session;
}

std::string_view ends_name(Ends ends) {
  switch (ends) {
    case Ends::session:
      return "session";
    case Ends::request:
      return "request";
    case Ends::mesh:
      return "mesh";
  }
  return "session";
}

}  // namespace pmcd::proto
