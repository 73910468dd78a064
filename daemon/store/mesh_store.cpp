// SPDX-License-Identifier: MIT
// Checks, then the tables behind a guard against what they throw.
#include "daemon/store/mesh_store.h"

#include <utility>

#include "daemon/store/guarded.h"
#include "daemon/store/mesh_tables.h"
#include "daemon/store/rule_history.h"

namespace pmcd::store {

MeshSummary summarize(const codec::Directory& directory) {
  MeshSummary summary;
  summary.generation = directory.generation;
  summary.format_version = directory.format_version;
  summary.lossless = directory.lossless;
  summary.lattice = directory.lattice;
  summary.box_min = directory.box_min;
  summary.box_max = directory.box_max;
  summary.vertices = directory.levels.back().vertices;
  summary.faces = directory.levels.back().faces;
  summary.packets = static_cast<std::uint32_t>(directory.levels.size());
  for (const codec::LevelEntry& level : directory.levels) summary.bytes += level.bytes;
  return summary;
}

Error name_taken(std::string_view name) {
  return {ErrorCode::name_taken, "a mesh named \"" + std::string(name) + "\" is in the database already"};
}

MeshStore::MeshStore(std::string path, std::unique_ptr<MeshTables> tables)
    : path_(std::move(path)), tables_(std::move(tables)), rules_(std::make_unique<RuleHistory>(tables_->db())) {}

MeshStore::~MeshStore() = default;

Result<std::unique_ptr<MeshStore>> MeshStore::open(const std::string& path) {
  return guarded([&]() -> Result<std::unique_ptr<MeshStore>> {
    auto tables = std::make_unique<MeshTables>(path);
    if (const Status status = tables->prepare(); !status.ok()) return status.error();
    return std::unique_ptr<MeshStore>(new MeshStore(path, std::move(tables)));
  });
}

Result<Inserted> MeshStore::insert(const NewMesh& mesh) {
  if (const Status status = check_name(mesh.name); !status.ok()) return status.error();
  if (const Status status = check_mesh(mesh.directory, mesh.packets); !status.ok()) return status.error();
  return guarded([&] { return tables_->insert(mesh); });
}

Result<MeshList> MeshStore::list() {
  return guarded([&]() -> Result<MeshList> { return tables_->list(); });
}

Result<Mesh> MeshStore::find(std::string_view name) {
  return guarded([&] { return tables_->find(name); });
}

Result<Mesh> MeshStore::find_generation(std::uint64_t generation) {
  return guarded([&] { return tables_->find_generation(generation); });
}

Result<bool> MeshStore::contains(std::string_view name) {
  return guarded([&]() -> Result<bool> { return tables_->live(name).has_value(); });
}

Result<std::vector<std::byte>> MeshStore::read_packet(MeshId mesh, std::uint32_t level) {
  return guarded([&] { return tables_->read_packet(mesh, level); });
}

Result<Removed> MeshStore::remove(std::string_view name) {
  return guarded([&] { return tables_->remove(name); });
}

Result<std::vector<MeshId>> MeshStore::retired() {
  return guarded([&]() -> Result<std::vector<MeshId>> { return tables_->retired(); });
}

Result<Collected> MeshStore::collect(MeshId mesh) {
  return guarded([&]() -> Result<Collected> { return tables_->collect(mesh); });
}

}  // namespace pmcd::store
