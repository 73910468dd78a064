// SPDX-License-Identifier: MIT
// The header of a packet: a packet stands for itself and says what it is, how long, of which mesh, and what hash the
// finished level must have. Layout (little endian), then the payload:
//   0 u8 0x9B  1 u8 flags (bit 0: last, bits 1 to 3: digits that positions lack) and format version (bits 4 to 7)
//   2 u32 CRC32C of all other bytes
//   6 varints: level, payload bytes, vertices, zigzag of faces - 2 * vertices; u8 digits that positions lack if bits 1
//   to 3 are 7 u64 mesh hash in the last packet, else its low 24 bits; u64 generation in the base packet, else its low
//   16 bits
// It does not look into the payload.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/result.h"

namespace pmcd::codec {

class ByteReader;
class ByteWriter;

inline constexpr std::uint8_t kFormatVersion = 0;
inline constexpr std::uint8_t kPacketMagic = 0x9B;  ///< no ASCII, and no UTF-8 text begins with it
inline constexpr std::size_t kHeaderFlagsOffset = 1;
inline constexpr std::size_t kHeaderChecksumOffset = 2;
inline constexpr std::size_t kHeaderNumbersOffset = 6;  ///< level, payload bytes and counts
/// Of a refinement packet that is not the last, all its numbers below 64.
inline constexpr std::size_t kLeastHeaderBytes = 15;
inline constexpr std::size_t kMostHeaderBytes = 6 + 4 * 5 + 1 + 8 + 8;  // a varint has at most 5

struct PacketHeader {
  bool last = false;
  std::uint32_t level = 0;          ///< that it completes; 0: the base packet
  std::uint32_t payload_bytes = 0;  ///< taken from the payload when written
  std::uint32_t vertices = 0;       ///< of the finished level, isolated ones included
  std::uint32_t faces = 0;
  /// Binary digits of the lattice indices that the finished level's positions lack; none in the last packet.
  std::uint8_t missing_digits = 0;
  std::uint64_t mesh_hash = 0;   ///< of the finished level, see hash.h; read from a packet: as much as it holds
  std::uint64_t generation = 0;  ///< content hash of the whole stream; read from a packet: as much as it holds
  std::uint32_t crc32c = 0;
  std::size_t size = 0;  ///< bytes of the header; the payload starts here

  [[nodiscard]] bool is_base() const { return level == 0; }
  /// Whether a packet with this header belongs to the stream with that generation, as far as it can tell.
  [[nodiscard]] bool is_of(std::uint64_t whole_generation) const;
  /// Whether the finished level with that hash is the one that was encoded, as far as it can tell.
  [[nodiscard]] bool proves(std::uint64_t whole_hash) const;
};

/// Reads a header from the first bytes of `packet` and checks its form; the payload and the checksum are not looked at.
/// Errors: truncated, bad_magic, unsupported_version, unsupported_feature, corrupt_data (a number out of its range or
/// longer than it needs to be; where = byte).
Result<PacketHeader> parse_packet_header(std::span<const std::byte> packet);

/// The same, and that `packet` is exactly one whole packet whose checksum is right.
/// Errors: also truncated, trailing_bytes, checksum_mismatch.
Result<PacketHeader> check_packet(std::span<const std::byte> packet);

/// The packet of `header` around `payload`; crc32c, payload_bytes and size of the header are not looked at.
/// REQUIRES: payload.size() < 2^32 - kMostHeaderBytes, missing_digits < kMaxLatticeBits.
std::vector<std::byte> make_packet(const PacketHeader& header, std::span<const std::byte> payload);

/// The faces of a level as a varint next to its vertices: a closed surface has about twice as many.
void write_faces(ByteWriter& writer, std::uint32_t vertices, std::uint32_t faces);
/// Nothing: the reader failed, or the number is none of 32 bits.
std::optional<std::uint32_t> read_faces(ByteReader& reader, std::uint32_t vertices);

}  // namespace pmcd::codec
