// SPDX-License-Identifier: MIT
// Rows of the database as entries of the list, and the cutting of pages.
#include "daemon/net/mesh_index.h"

#include <algorithm>
#include <utility>

#include "proto/text.h"

namespace pmcd::net {
namespace {

proto::MeshListEntry list_entry(const store::MeshSummary& mesh) {
  proto::MeshListEntry entry;
  entry.name = mesh.name;
  entry.generation = mesh.generation;
  entry.vertices = mesh.vertices;
  entry.faces = mesh.faces;
  entry.levels = mesh.packets;
  entry.bytes = mesh.bytes;
  entry.lossless = mesh.lossless;
  entry.float64 = mesh.lattice.scalar == codec::Scalar::float64;
  entry.bits = static_cast<std::uint8_t>(mesh.lattice.bits);
  entry.format_version = mesh.format_version;
  entry.box_min = mesh.box_min;
  entry.box_max = mesh.box_max;
  return entry;
}

std::uint32_t page_size(std::uint32_t most) {
  return most == 0 ? proto::kMaxPageEntries : std::min(most, proto::kMaxPageEntries);
}

}  // namespace

std::uint64_t ListSize::page_bytes(std::uint32_t most) const {
  const std::uint64_t count = std::min<std::uint64_t>(meshes, page_size(most));
  if (count == 0) return proto::kMeshPageHeadBytes;
  return proto::kMeshPageHeadBytes + count * proto::kNamelessEntryBytes + count * name_bytes / meshes;
}

MeshIndex::MeshIndex(const std::vector<store::MeshSummary>& meshes) {
  entries_.reserve(meshes.size());
  for (const store::MeshSummary& mesh : meshes) {
    if (!proto::is_mesh_name(mesh.name)) continue;
    entries_.push_back(list_entry(mesh));
    name_bytes_ += mesh.name.size();
  }
}

proto::MeshPage MeshIndex::page(std::string_view filter, std::string_view after, std::uint32_t most) const {
  const std::size_t size = page_size(most);
  const auto begin = std::upper_bound(entries_.begin(), entries_.end(), after,
                                      [](std::string_view name, const auto& entry) { return name < entry.name; });
  proto::MeshPage page;
  if (filter.empty()) {
    const auto left = static_cast<std::size_t>(entries_.end() - begin);
    const std::size_t count = std::min(size, left);
    page.matches = static_cast<std::uint32_t>(entries_.size());
    page.remaining = static_cast<std::uint32_t>(left - count);
    page.entries.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
    return page;
  }
  for (auto it = entries_.begin(); it != entries_.end(); ++it) {
    if (!proto::matches_filter(it->name, filter)) continue;
    ++page.matches;
    if (it < begin) continue;
    if (page.entries.size() < size) {
      page.entries.push_back(*it);
    } else {
      ++page.remaining;
    }
  }
  return page;
}

}  // namespace pmcd::net
