// SPDX-License-Identifier: MIT
// The tables of meshes and packets in SQL, over a connection of their own with its statements prepared. What is wrong
// with a request is a value; what SQLite complains of, and a row that cannot be, is thrown as SqliteError: mesh_store.h
// is for the others. It checks no mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/store/db.h"
#include "daemon/store/mesh_store.h"

namespace pmcd::store {

/// Its functions do what those of MeshStore of the same name do.
class MeshTables {
 public:
  explicit MeshTables(const std::string& path);
  ~MeshTables();
  MeshTables(const MeshTables&) = delete;
  MeshTables& operator=(const MeshTables&) = delete;

  /// Makes or migrates the tables. REQUIRES: called first, and nothing else when it fails.
  Status prepare();

  Result<Inserted> insert(const NewMesh& mesh);
  /// Names and ids come out of the index; the rows one by one, so that a page that is damaged costs its own meshes
  /// only.
  MeshList list();
  /// The live mesh of that name.
  std::optional<MeshId> live(std::string_view name);
  Result<Mesh> find(std::string_view name);
  Result<Mesh> find_generation(std::uint64_t generation);
  Result<std::vector<std::byte>> read_packet(MeshId mesh, std::uint32_t level);
  Result<Removed> remove(std::string_view name);
  std::vector<MeshId> retired();
  Collected collect(MeshId mesh);

  /// The connection, for other tables of the same database.
  [[nodiscard]] Db& db() { return db_; }

 private:
  struct Statements;

  /// Throws SqliteError, also if the index names a row that there is not.
  MeshSummary summary(MeshId mesh);
  std::uint64_t generation(MeshId mesh);
  Result<Mesh> with_levels(MeshSummary summary);
  void retire(MeshId mesh);
  /// Nothing if there is no such mesh.
  std::optional<bool> is_live(MeshId mesh);
  /// Packets from this level on are what one step deletes; nothing if one step deletes the whole mesh.
  std::optional<std::int64_t> first_to_delete(MeshId mesh);
  Error why_no_packet(MeshId mesh, std::uint32_t level);

  Db db_;
  std::unique_ptr<Statements> statements_;
};

}  // namespace pmcd::store
