// SPDX-License-Identifier: MIT
// Writing and reading the mesh list.
#include "proto/mesh_list.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/body.h"
#include "proto/text.h"

namespace pmcd::proto {

namespace {

constexpr std::size_t kMinEntryBytes = kNamelessEntryBytes + 1;
constexpr std::uint8_t kLossless = 1;
constexpr std::uint8_t kFloat64 = 2;

}  // namespace

bool matches_filter(std::string_view name, std::string_view filter) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  const auto same = [lower](char a, char b) { return lower(a) == lower(b); };
  return std::search(name.begin(), name.end(), filter.begin(), filter.end(), same) != name.end() || filter.empty();
}

Bytes encode_mesh_page(const MeshPage& page) {
  ByteWriter writer;
  writer.u32(page.matches);
  writer.u32(page.remaining);
  writer.u32(static_cast<std::uint32_t>(page.entries.size()));
  for (const MeshListEntry& entry : page.entries) {
    writer.str8(entry.name);
    writer.u64(entry.generation);
    writer.u32(entry.vertices);
    writer.u32(entry.faces);
    writer.u32(entry.levels);
    writer.u64(entry.bytes);
    writer.u8(static_cast<std::uint8_t>((entry.lossless ? kLossless : 0) | (entry.float64 ? kFloat64 : 0)));
    writer.u8(entry.bits);
    writer.u8(entry.format_version);
    for (const double v : entry.box_min) writer.f64(v);
    for (const double v : entry.box_max) writer.f64(v);
  }
  return writer.take();
}

Result<MeshPage> decode_mesh_page(ByteView bytes) {
  ByteReader reader(bytes);
  MeshPage page;
  page.matches = reader.u32();
  page.remaining = reader.u32();
  const std::uint32_t count = reader.u32();
  if (reader.failed() || count > reader.left() / kMinEntryBytes) {
    return malformed(8, "the mesh list is too short for the number of meshes that it claims");
  }
  if (count > kMaxPageEntries) return malformed(8, "a page of the mesh list has too many meshes");
  if (page.matches < page.remaining || page.matches - page.remaining < count) {
    return malformed(0, "the mesh list has fewer matches than meshes");
  }
  std::vector<MeshListEntry>& entries = page.entries;
  entries.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t start = reader.position();
    MeshListEntry entry;
    entry.name = reader.str8();
    entry.generation = reader.u64();
    entry.vertices = reader.u32();
    entry.faces = reader.u32();
    entry.levels = reader.u32();
    entry.bytes = reader.u64();
    const std::uint8_t flags = reader.u8();
    entry.lossless = (flags & kLossless) != 0;
    entry.float64 = (flags & kFloat64) != 0;
    entry.bits = reader.u8();
    entry.format_version = reader.u8();
    bool finite = true;
    for (double& v : entry.box_min) v = reader.f64(), finite = finite && std::isfinite(v);
    for (double& v : entry.box_max) v = reader.f64(), finite = finite && std::isfinite(v);
    if (reader.failed()) return malformed(start, "the mesh list ends within an entry");
    if (!is_mesh_name(entry.name)) return malformed(start, "the mesh list holds a name that is not allowed");
    if (!entries.empty() && entry.name <= entries.back().name) {
      return malformed(start, "the names of the mesh list do not ascend");
    }
    if ((flags & ~(kLossless | kFloat64)) != 0) return malformed(start, "unknown flags in the mesh list");
    if (!finite) return malformed(start, "a bounding box in the mesh list is not finite");
    entries.push_back(std::move(entry));
  }
  if (!reader.finished()) return malformed(reader.position(), "bytes after the last entry of the mesh list");
  return page;
}

}  // namespace pmcd::proto
