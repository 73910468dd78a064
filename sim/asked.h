// SPDX-License-Identifier: MIT
// A client's request for a packet, and what the scheduler is told of it: the same over both networks. It decides
// nothing.
#pragma once

#include <cmath>
#include <cstdint>

#include "daemon/scheduler/request.h"
#include "sim/meshes.h"

namespace pmcd::sim {

struct Asked {
  std::uint32_t mesh = 0;
  std::uint32_t packet = 0;
  double at = 0;  ///< seconds
};

/// The scheduler's time of a moment.
inline scheduler::Time scheduler_time(double seconds) {
  return scheduler::Time(std::llround(seconds * 1e9));
}

/// The session of a client, who are numbered from 0.
inline scheduler::SessionKey session_of(std::uint32_t client) {
  return scheduler::SessionKey{client} + 1;
}

/// Nothing of the packet is sent yet. REQUIRES: `mesh` is the one asked
/// for, and has the packet.
inline scheduler::Request request_for(const Asked& asked, const Mesh& mesh, scheduler::RequestKey key,
                                      std::uint32_t client) {
  scheduler::Request request;
  request.key = key;
  request.session = session_of(client);
  request.mesh = asked.mesh;
  request.packet = asked.packet;
  request.size_bytes = mesh.levels[asked.packet].bytes;
  request.rest_bytes = mesh.profile->bytes_behind(asked.packet);
  request.profile = mesh.profile;
  request.asked_at = scheduler_time(asked.at);
  return request;
}

}  // namespace pmcd::sim
