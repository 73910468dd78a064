// SPDX-License-Identifier: MIT
// The rules of a session that need no socket: which client frame is allowed in which state, and which ids are open. The
// daemon asks here before it acts; docs/PROTOCOL.md draws the same machine. No timers, no I/O.
#pragma once

#include <cstddef>
#include <cstdint>

#include <array>

#include "proto/codes.h"
#include "proto/messages.h"

namespace pmcd::proto {

enum class Channel : std::uint8_t { request, data, admin };

/// State of a session seen from one of its channels.
/// request: fresh (no hello yet) -> greeted (hello_ok sent) -> joined (the data channel has joined).
/// data: fresh (no join yet) -> joined. admin: fresh -> joined (admin_hello_ok sent).
enum class SessionState : std::uint8_t { fresh, greeted, joined };

/// Whether a client may send a frame of `type` now: ErrorCode::none, or the code to answer with. The code's table line
/// says what it ends; unknown_type and not_joined leave the session standing. A fresh channel answers wrong_state to
/// everything but its first frame, unknown types included.
ErrorCode check_client_frame(Channel channel, SessionState state, std::uint16_t type);

/// The ids of the requests that are open in one session, at most kMaxOpenRequests. No allocation.
class OpenRequests {
 public:
  /// Takes a request in. malformed: id 0; duplicate_id: open already (ends the session: an answer would be ambiguous);
  /// too_many_requests: kMaxOpenRequests are open. Nothing is taken in unless the answer is none.
  ErrorCode open(std::uint32_t id);
  /// Ends a request. False when it was not open.
  bool end(std::uint32_t id);
  [[nodiscard]] bool is_open(std::uint32_t id) const;
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  std::array<std::uint32_t, kMaxOpenRequests> ids_{};
  std::size_t count_ = 0;
};

}  // namespace pmcd::proto
