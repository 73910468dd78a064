// SPDX-License-Identifier: MIT
// Weak pointers by id, two indices to the ids, and a short list that holds.
#include "daemon/net/held_meshes.h"

#include <algorithm>
#include <utility>

namespace pmcd::net {
namespace {

template <typename Index, typename Key>
void erase_if_it_names(Index& index, const Key& key, store::MeshId mesh) {
  if (const auto known = index.find(key); known != index.end() && known->second == mesh) index.erase(known);
}

}  // namespace

SharedMesh HeldMeshes::find(const std::string& name) {
  const auto known = names_.find(name);
  if (known == names_.end()) return nullptr;
  SharedMesh mesh = meshes_.at(known->second).lock();
  keep(mesh);
  return mesh;
}

SharedMesh HeldMeshes::find_generation(std::uint64_t generation) {
  const auto known = generations_.find(generation);
  if (known == generations_.end()) return nullptr;
  SharedMesh mesh = meshes_.at(known->second).lock();
  keep(mesh);
  return mesh;
}

SharedMesh HeldMeshes::hold(CatalogMesh mesh) {
  const store::MeshId id = mesh.mesh.summary.id;
  if (const auto it = meshes_.find(id); it != meshes_.end()) return it->second.lock();
  const auto let_go = [holder = std::weak_ptr<HeldMeshes*>(self_)](const CatalogMesh* released) {
    const std::unique_ptr<const CatalogMesh> owned(released);
    if (const auto alive = holder.lock()) (*alive)->released(owned->mesh.summary);
  };
  SharedMesh held(std::make_unique<CatalogMesh>(std::move(mesh)).release(), let_go);
  meshes_[id] = held;
  collector_.held(id);
  return held;
}

void HeldMeshes::found_by_generation(const SharedMesh& mesh) {
  generations_[mesh->mesh.summary.generation] = mesh->mesh.summary.id;
  keep(mesh);
}

void HeldMeshes::found_by_name(const SharedMesh& mesh) {
  names_[mesh->mesh.summary.name] = mesh->mesh.summary.id;
  found_by_generation(mesh);
}

bool HeldMeshes::retire(store::MeshId mesh) {
  const auto it = meshes_.find(mesh);
  if (it == meshes_.end()) return false;
  {
    const SharedMesh retired = it->second.lock();
    forget(retired->mesh.summary);
    std::erase(kept_, retired);
  }
  return meshes_.contains(mesh);
}

void HeldMeshes::keep(const SharedMesh& mesh) {
  const auto at = std::find(kept_.begin(), kept_.end(), mesh);
  if (at != kept_.end()) {
    std::rotate(kept_.begin(), at, at + 1);
    return;
  }
  kept_.insert(kept_.begin(), mesh);
  if (kept_.size() > kMostKept) kept_.pop_back();
}

void HeldMeshes::forget(const store::MeshSummary& mesh) {
  erase_if_it_names(names_, mesh.name, mesh.id);
  erase_if_it_names(generations_, mesh.generation, mesh.id);
}

void HeldMeshes::released(const store::MeshSummary& mesh) {
  forget(mesh);
  meshes_.erase(mesh.id);
  collector_.released(mesh.id);
}

}  // namespace pmcd::net
