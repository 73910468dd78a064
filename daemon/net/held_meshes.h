// SPDX-License-Identifier: MIT
// The meshes that somebody holds, each as the one object that all share, and the few that were asked for last: those
// are found without the database, by name or by content. It reads nothing itself (catalog.h does), and tells the
// collector who is held. One thread only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/net/collector.h"
#include "daemon/net/mesh_source.h"

namespace pmcd::net {

class HeldMeshes {
 public:
  /// So many are kept although nobody may hold them, so that who asks again and again makes the database read once. At
  /// some 70 bytes a level they are little.
  static constexpr std::size_t kMostKept = 8;

  /// REQUIRES: `collector` outlives it.
  explicit HeldMeshes(Collector& collector) : collector_(collector) {}
  HeldMeshes(const HeldMeshes&) = delete;
  HeldMeshes& operator=(const HeldMeshes&) = delete;

  /// The live mesh of that name; null if the database is to be asked.
  SharedMesh find(const std::string& name);
  /// A live mesh of that content; null if the database is to be asked.
  SharedMesh find_generation(std::uint64_t generation);

  /// The one object of a mesh that was read.
  SharedMesh hold(CatalogMesh mesh);
  /// The mesh is live: it is found by its content from now on.
  void found_by_generation(const SharedMesh& mesh);
  /// And by its name.
  void found_by_name(const SharedMesh& mesh);

  /// The database has changed: names may mean other meshes.
  void changed() { names_.clear(); }
  /// The mesh is live no more, it is neither found nor kept; whether somebody else holds it.
  bool retire(store::MeshId mesh);

 private:
  void keep(const SharedMesh& mesh);
  void forget(const store::MeshSummary& mesh);
  void released(const store::MeshSummary& mesh);

  Collector& collector_;
  std::map<store::MeshId, std::weak_ptr<const CatalogMesh>> meshes_;
  std::map<std::string, store::MeshId> names_;
  std::map<std::uint64_t, store::MeshId> generations_;
  std::vector<SharedMesh> kept_;  ///< the one that was asked for last comes first
  /// A mesh that is let go finds this object through this, if it is still there.
  std::shared_ptr<HeldMeshes*> self_ = std::make_shared<HeldMeshes*>(this);
};

}  // namespace pmcd::net
