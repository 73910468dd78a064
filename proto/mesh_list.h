// SPDX-License-Identifier: MIT
// The mesh list: the bytes of the transfer that answers get_mesh_list. Layout: u32 count, then the entries one after
// the other, ascending by name (bytewise). Paging comes with a later minor version and a request of its own.
#pragma once

#include <array>
#include <cstdint>
#include <string>
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

/// What a client accepts by default, judged by a transfer's `total` before it takes the first byte.
inline constexpr std::uint64_t kMaxMeshListBytes = std::uint64_t{64} << 20;

/// REQUIRES: every name is_mesh_name, ascending and different; fewer than 2^32 entries.
Bytes encode_mesh_list(const std::vector<MeshListEntry>& entries);

/// Errors: malformed (cut short, left over, a count that the bytes cannot hold, a name that is none, names out of
/// order, unknown flags, a box that is not finite). Allocates no more than a small multiple of bytes.size().
Result<std::vector<MeshListEntry>> decode_mesh_list(ByteView bytes);

}  // namespace pmcd::proto
