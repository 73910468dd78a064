// SPDX-License-Identifier: MIT
// What a peer may make the daemon hold or wait for. One struct, so that tests can shorten the times and the
// configuration can set what an operator should.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

#include "daemon/turns/limits.h"
#include "proto/messages.h"

namespace pmcd::net {

struct Limits : turns::Limits {
  std::size_t sessions = 9'000;            ///< request connections, greeted or not; as many data connections
  std::size_t sessions_per_address = 256;  ///< of one IPv4 address or one IPv6 network of 64 bits
  std::size_t admin_connections = 128;
  std::size_t spare_data_connections = 32;  ///< beyond one a session: of sessions that have just ended, or never begin
  std::size_t stray_data_connections = 4;   ///< of one address, beyond those that its sessions wait for
  std::size_t turned_away = 64;             ///< refused connections that may linger, a quarter of one address
  std::size_t meshes_per_session = proto::kMaxLiveHandles;

  std::chrono::milliseconds hello{10'000};  ///< from the connection to its first whole frame, on every channel
  std::chrono::milliseconds join{std::chrono::seconds(proto::kJoinSeconds)};
  std::chrono::milliseconds admin_idle{300'000};
  std::chrono::milliseconds linger{1'000};   ///< for last bytes to reach a peer that is being closed
  std::chrono::milliseconds drain{5'000};    ///< for running transfers when the daemon ends
  std::chrono::milliseconds grace{600'000};  ///< for sessions with a mesh that was replaced or removed

  std::size_t cache_bytes = std::size_t{64} << 20;  ///< of packets that were sent lately, shared by all sessions
  std::size_t queued_frames = 1'024;     ///< of short answers to a client that does not read them; then it is dropped
  std::size_t queued_bytes = 64 * 1024;  ///< of frames that wait for a socket; writers pause above it
};

}  // namespace pmcd::net
