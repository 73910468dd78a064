// SPDX-License-Identifier: MIT
// A request that waits for its turn or runs, as sessions and the dispatcher pass it between them. Values only.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/net/mesh_source.h"
#include "daemon/scheduler/request.h"
#include "proto/messages.h"

namespace pmcd::net {

class Session;

struct Transfer {
  std::shared_ptr<Session> session;
  std::uint32_t id = 0;  ///< the client's
  std::uint32_t handle = 0;
  std::uint32_t packet = 0;
  std::uint64_t offset = 0;  ///< in the packet, of the first byte that is asked for
  bool begun = false;        ///< a part of it was sent
  bool is_reading = false;   ///< its packet comes from the store
  store::MeshId mesh = 0;
  SharedMesh of;  ///< the same; null for a mesh list
  /// Of a mesh list, which has no handle: what is asked for. Its page is made when its turn comes, so that those who
  /// wait hold no memory.
  std::optional<proto::GetMeshList> list;
  /// The whole packet or page, from when the transfer has started until all of it is queued, and of an interrupted one
  /// as long as it is kept.
  SharedBytes bytes;
  std::shared_ptr<const void> kept;  ///< of an interrupted one that keeps its packet: holds the room that it takes
};

}  // namespace pmcd::net
