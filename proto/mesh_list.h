// SPDX-License-Identifier: MIT
// A page of the mesh list: the bytes of the transfer that answers get_mesh_list. Layout: u32 matches, u32 remaining,
// u32 count, then the entries one after the other, ascending by name (bytewise). Which meshes match is the server's to
// find; matches_filter is the rule for it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/bytes.h"
#include "proto/result.h"

namespace pmcd::proto {

/// str8 name, u64 generation, u32 vertices, u32 faces, u32 levels, u64 bytes, u8 flags (bit 0 lossless, bit 1 float64),
/// u8 lattice bits, u8 format version, 3 f64 box min, 3 f64 box max. At least 81 bytes.
struct MeshListEntry {
  std::string name;
  std::uint64_t generation = 0;  ///< content hash: changes when the mesh is replaced by another
  std::uint32_t vertices = 0;    ///< of the last level
  std::uint32_t faces = 0;
  std::uint32_t levels = 0;  ///< packets, the base included
  std::uint64_t bytes = 0;   ///< of all packets
  bool lossless = false;
  bool float64 = false;   ///< coordinates are doubles, else float32
  std::uint8_t bits = 0;  ///< of the lattice
  std::uint8_t format_version = 0;
  std::array<double, 3> box_min{};
  std::array<double, 3> box_max{};
  bool operator==(const MeshListEntry&) const = default;
};

/// What one get_mesh_list is answered with.
struct MeshPage {
  std::uint32_t matches = 0;    ///< meshes that match the filter, in the whole list
  std::uint32_t remaining = 0;  ///< of these, how many come after this page; 0: it is the last
  std::vector<MeshListEntry> entries;
  bool operator==(const MeshPage&) const = default;
};

/// Bytes of a page without its entries, and of an entry without its name.
inline constexpr std::size_t kMeshPageHeadBytes = 12;
inline constexpr std::size_t kNamelessEntryBytes = 80;
/// Entries on a page at most, whatever was asked for.
inline constexpr std::uint32_t kMaxPageEntries = 1'000;
/// What a client accepts, judged by a transfer's `total` before it takes the first byte: more than a full page has.
inline constexpr std::uint64_t kMaxMeshPageBytes = std::uint64_t{256} * 1024;

/// Whether `name` contains `filter`, ASCII letters compared without case, all other bytes exactly. [O(name * filter)]
bool matches_filter(std::string_view name, std::string_view filter);

/// REQUIRES: every name is_mesh_name, ascending and different; at most kMaxPageEntries entries.
Bytes encode_mesh_page(const MeshPage& page);

/// Errors: malformed (cut short, left over, a count that the bytes cannot hold or over kMaxPageEntries, fewer matches
/// than entries and remaining ones, a name that is none, names out of order, unknown flags, a box that is not finite).
/// Allocates no more than a small multiple of bytes.size().
Result<MeshPage> decode_mesh_page(ByteView bytes);

}  // namespace pmcd::proto
