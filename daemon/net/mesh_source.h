// SPDX-License-Identifier: MIT
// Where sessions and transfers get meshes from, as an interface: the daemon's catalog over the database, or a few
// meshes in memory in a test. It says nothing of who asks or in which order.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "daemon/net/asio.h"
#include "daemon/net/shared_bytes.h"
#include "daemon/scheduler/mesh_profile.h"
#include "daemon/store/mesh_store.h"
#include "proto/bytes.h"

namespace pmcd::net {

/// A mesh as sessions hold it. As long as somebody holds it, its packets can be read although it was replaced or
/// removed, until the grace time is over.
struct CatalogMesh {
  store::Mesh mesh;
  proto::Bytes directory;                                 ///< as it travels
  std::shared_ptr<const scheduler::MeshProfile> profile;  ///< what its packets cost and bring
};
using SharedMesh = std::shared_ptr<const CatalogMesh>;

/// Of a mesh as the store knows it; errors as the level directory has them.
std::shared_ptr<const scheduler::MeshProfile> make_profile(const store::Mesh& mesh);

class MeshSource {
 public:
  MeshSource() = default;
  MeshSource(const MeshSource&) = delete;
  MeshSource& operator=(const MeshSource&) = delete;
  virtual ~MeshSource() = default;

  /// The bytes of a page of the mesh list, see proto/mesh_list.h: names that match `filter` and are greater than
  /// `after`, at most `most` of them (0: as many as a page holds).
  virtual awaitable<store::Result<SharedBytes>> mesh_list(std::string filter, std::string after,
                                                          std::uint32_t most) = 0;
  /// About how many bytes such a page has, at least 1, whatever its filter. [O(1)]
  [[nodiscard]] virtual std::uint64_t mesh_list_bytes(std::uint32_t most) const = 0;
  /// Error: unknown_mesh.
  virtual awaitable<store::Result<SharedMesh>> find(std::string name) = 0;
  /// A mesh of this content, whatever its name. Error: unknown_mesh.
  virtual awaitable<store::Result<SharedMesh>> find_generation(std::uint64_t generation) = 0;
  /// Error: unknown_mesh when the mesh was replaced or removed and is gone; others when it cannot be read.
  virtual awaitable<store::Result<SharedBytes>> read_packet(store::MeshId mesh, std::uint32_t packet) = 0;
  /// The same without waiting: null if it takes a read. [O(1)]
  virtual SharedBytes cached_packet(store::MeshId mesh, std::uint32_t packet) = 0;
};

}  // namespace pmcd::net
