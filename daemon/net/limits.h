// SPDX-License-Identifier: MIT
// What a peer may make the daemon hold or wait for. One struct, so that tests can shorten the times.
#pragma once

#include <chrono>
#include <cstddef>

#include "proto/messages.h"

namespace pmcd::net {

struct Limits {
  std::size_t sessions = 4'000;  ///< request connections, greeted or not; as many data connections
  std::size_t admin_connections = 32;
  std::size_t meshes_per_session = 1'024;  ///< handles given out in one session

  std::chrono::milliseconds hello{10'000};  ///< from the connection to its first whole frame, on every channel
  std::chrono::milliseconds join{std::chrono::seconds(proto::kJoinSeconds)};
  std::chrono::milliseconds stall{10'000};  ///< a running transfer, or an answer, without a byte of progress
  std::chrono::milliseconds admin_idle{300'000};
  std::chrono::milliseconds linger{1'000};  ///< for last bytes to reach a peer that is being closed
  std::chrono::milliseconds drain{5'000};   ///< for running transfers when the daemon ends

  std::size_t chunk_bytes = 32 * 1024;
  std::size_t queued_frames = 1'024;     ///< of short answers to a client that does not read them; then it is dropped
  std::size_t queued_bytes = 64 * 1024;  ///< of frames that wait for a socket; writers pause above it
};

}  // namespace pmcd::net
