// SPDX-License-Identifier: MIT
// A request that waits for its turn or runs, as sessions and the dispatcher pass it between them. Values only.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/net/mesh_source.h"
#include "daemon/scheduler/request.h"

namespace pmcd::net {

class Session;

struct Transfer {
  std::shared_ptr<Session> session;
  std::uint32_t id = 0;  ///< the client's
  std::uint32_t handle = 0;
  std::uint32_t packet = 0;
  std::uint64_t offset = 0;  ///< in the packet, of the first byte that is sent
  store::MeshId mesh = 0;
  SharedBytes bytes;  ///< the whole packet; null: it is read when the transfer starts
};

}  // namespace pmcd::net
