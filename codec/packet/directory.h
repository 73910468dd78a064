// SPDX-License-Identifier: MIT
// A .pmcd file: a directory with a checksum of its own, then the packets one after the other. The directory tells what
// a level costs and is worth before it is fetched; the packets do not need it. No file access here: bytes in, bytes
// out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/lattice/lattice.h"
#include "codec/result.h"

namespace pmcd::codec {

/// One line of the directory: what packet k brings.
struct LevelEntry {
  std::uint32_t bytes = 0;     ///< of the packet, header included
  std::uint32_t vertices = 0;  ///< of the finished level
  std::uint32_t faces = 0;
  std::uint8_t bits = 0;     ///< of the lattice's bits, those that the finished level's positions have
  std::uint32_t crc32c = 0;  ///< the packet's own checksum field
  /// Distance from original vertices to the level's surface relative to the bounding-box diagonal; negative: not
  /// measured.
  double error_rms = -1;
  double error_max = -1;
};

struct Directory {
  std::uint8_t format_version = 0;
  bool lossless = false;
  std::uint64_t generation = 0;  ///< content hash of the packets; the same in every packet's header
  Lattice lattice;
  Position box_min{0, 0, 0};  ///< bounding box of the original
  Position box_max{0, 0, 0};
  std::vector<LevelEntry> levels;
};

/// The directory of a sequence of packets, read from their headers; errors of levels stay "not measured" and the
/// bounding box is the lattice's. Refuses packets that are damaged, out of order or of different meshes.
Result<Directory> make_directory(std::span<const std::span<const std::byte>> packets);

/// Bytes of the directory as they stand at the start of a file. REQUIRES: no level has fewer bits than the one before,
/// the last has all of the lattice's; else what it makes will be refused.
std::vector<std::byte> serialize(const Directory& directory);

struct ParsedDirectory {
  Directory directory;
  std::size_t size = 0;  ///< bytes that the directory takes; packet 0 starts here
};

/// Reads a directory from the start of `file` (which may be longer); the levels it claims must fit into it.
Result<ParsedDirectory> parse_directory(std::span<const std::byte> file);

/// A whole file: checks the directory, that the packets fill the rest exactly, and each packet's header and checksum
/// against its directory entry. The spans point into `file`.
struct ParsedFile {
  Directory directory;
  std::vector<std::span<const std::byte>> packets;
};
Result<ParsedFile> parse_file(std::span<const std::byte> file);

}  // namespace pmcd::codec
