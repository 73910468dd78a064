// SPDX-License-Identifier: MIT
// The meshes that one session has open: their handles, the place in each, and the requests that wait in line for each.
// Bookkeeping only: it sends nothing and reads nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/mesh_source.h"
#include "daemon/scheduler/request.h"
#include "proto/codes.h"

namespace pmcd::net {

/// A request for a packet, in line behind the others of its mesh.
struct Ask {
  enum class Kind : std::uint8_t { base, next, exact };
  std::uint32_t id = 0;
  Kind kind = Kind::next;
  std::uint32_t packet = 0;  ///< of an exact one; 0 of a base one
  std::uint64_t offset = 0;  ///< of an exact one
  Clock::time_point at;      ///< when the client asked
};

struct OpenMesh {
  SharedMesh mesh;
  std::uint32_t place = 0;                         ///< the packet that get_next_packet brings
  std::vector<Ask> line;                           ///< served one after the other
  std::optional<scheduler::RequestKey> busy;       ///< the first in line is with the dispatcher under this key
  proto::ErrorCode dead = proto::ErrorCode::none;  ///< why the handle is of no use any more
};

class OpenMeshes {
 public:
  using Handle = std::uint32_t;  ///< 0 is none

  /// `most`: handles that are given out at most.
  explicit OpenMeshes(std::size_t most) : most_(most) {}

  /// The handle of this mesh: the one it has already if it was opened under this name with this content, else a new one
  /// with its place at `place`. 0 if there are too many. [O(handles)]
  Handle open(const SharedMesh& mesh, std::uint32_t place);
  /// A live handle of this content, whatever its name; 0 if there is none. [O(handles)]
  [[nodiscard]] Handle of_generation(std::uint64_t generation) const;
  /// Live handles of the mesh that was stored under this id. [O(handles)]
  [[nodiscard]] std::vector<Handle> of_mesh(store::MeshId mesh) const;
  /// nullptr if the handle was not given out. Stays valid until clear(), or until open() makes room.
  OpenMesh* find(Handle handle);
  [[nodiscard]] const OpenMesh* find(Handle handle) const;

  /// What the client last asked for.
  [[nodiscard]] Handle last() const { return last_; }
  void set_last(Handle handle) { last_ = handle; }

  /// The handle in whose line request `id` stands; 0 if in none. [O(handles)]
  [[nodiscard]] Handle line_of(std::uint32_t id) const;
  void clear() { meshes_.clear(); }

 private:
  std::size_t most_;
  std::map<Handle, OpenMesh> meshes_;
  Handle last_ = 0;
  Handle next_ = 1;
};

}  // namespace pmcd::net
