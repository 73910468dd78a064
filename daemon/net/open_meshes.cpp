// SPDX-License-Identifier: MIT
// Handles: given out once, never reused in a session.
#include "daemon/net/open_meshes.h"

#include <algorithm>
#include <utility>

namespace pmcd::net {

OpenMeshes::Handle OpenMeshes::open(const SharedMesh& mesh, std::uint32_t place) {
  const store::MeshSummary& wanted = mesh->mesh.summary;
  for (auto& [handle, open] : meshes_) {
    const store::MeshSummary& summary = open.mesh->mesh.summary;
    if (open.dead == proto::ErrorCode::none && summary.name == wanted.name && summary.generation == wanted.generation) {
      open.mesh = mesh;  // the same content, perhaps stored anew under another id
      return handle;
    }
  }
  if (meshes_.size() >= most_) {
    std::erase_if(meshes_, [](const auto& entry) { return entry.second.dead != proto::ErrorCode::none; });
  }
  if (meshes_.size() >= most_) return 0;
  OpenMesh open;
  open.mesh = mesh;
  open.place = place;
  meshes_.emplace(next_, std::move(open));
  return next_++;
}

OpenMeshes::Handle OpenMeshes::of_generation(std::uint64_t generation) const {
  for (const auto& [handle, open] : meshes_) {
    if (open.dead == proto::ErrorCode::none && open.mesh->mesh.summary.generation == generation) return handle;
  }
  return 0;
}

std::vector<OpenMeshes::Handle> OpenMeshes::of_mesh(store::MeshId mesh) const {
  std::vector<Handle> handles;
  for (const auto& [handle, open] : meshes_) {
    if (open.dead == proto::ErrorCode::none && open.mesh->mesh.summary.id == mesh) handles.push_back(handle);
  }
  return handles;
}

const OpenMesh* OpenMeshes::find(Handle handle) const {
  const auto it = meshes_.find(handle);
  return it == meshes_.end() ? nullptr : &it->second;
}

OpenMesh* OpenMeshes::find(Handle handle) {
  const auto it = meshes_.find(handle);
  return it == meshes_.end() ? nullptr : &it->second;
}

OpenMeshes::Handle OpenMeshes::line_of(std::uint32_t id) const {
  for (const auto& [handle, open] : meshes_) {
    if (std::any_of(open.line.begin(), open.line.end(), [id](const Ask& ask) { return ask.id == id; })) return handle;
  }
  return 0;
}

}  // namespace pmcd::net
