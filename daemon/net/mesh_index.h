// SPDX-License-Identifier: MIT
// All live meshes of one version of the database as the mesh list names them, and pages cut out of it. It never
// changes: another version of the database is another index.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "daemon/store/mesh_store.h"
#include "proto/mesh_list.h"

namespace pmcd::net {

/// How long the whole list is, to judge by how long a page of it will be. At first: a list of one mesh.
struct ListSize {
  std::uint64_t meshes = 1;
  std::uint64_t name_bytes = 0;  ///< of all their names

  /// Bytes of a page of at most `most` meshes (0: as many as a page takes) whose names are as long as the mean one:
  /// exact for the whole list on one page, more than a page has that a filter makes shorter.
  [[nodiscard]] std::uint64_t page_bytes(std::uint32_t most) const;
};

class MeshIndex {
 public:
  /// REQUIRES: `meshes` ascend by name (bytewise). One whose name cannot travel is left out: nothing is ingested under
  /// such a name, but somebody else may have written to the file.
  explicit MeshIndex(const std::vector<store::MeshSummary>& meshes);

  /// Meshes whose names contain `filter` (proto::matches_filter) and come after `after`, ascending; at most `most` (0:
  /// as many as a page takes), never more than a page takes. [O(meshes) with a filter, else O(log meshes + page)]
  [[nodiscard]] proto::MeshPage page(std::string_view filter, std::string_view after, std::uint32_t most) const;
  [[nodiscard]] ListSize size() const { return {entries_.size(), name_bytes_}; }

 private:
  std::vector<proto::MeshListEntry> entries_;
  std::uint64_t name_bytes_ = 0;
};

}  // namespace pmcd::net
