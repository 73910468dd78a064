// SPDX-License-Identifier: MIT
// The header of a packet: a packet stands for itself and says what it is, how long, of which mesh, and what hash the
// finished level must have. Layout (little endian, 48 bytes), then the payload:
//   0 "PMCP"  4 u8 format version  5 u8 kind  6 u8 flags (bit 0: last)  7 u8 zero  8 u32 level  12 u32 payload bytes
//   16 u32 vertices  20 u32 faces  24 u64 mesh hash  32 u64 generation  40 u32 zero  44 u32 CRC32C of all other bytes
// It does not look into the payload.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "codec/result.h"

namespace pmcd::codec {

inline constexpr std::uint8_t kFormatVersion = 0;
inline constexpr std::size_t kPacketHeaderBytes = 48;

// Part of the format: never change a value.
enum class PacketKind : std::uint8_t {
  base = 0,        ///< the base mesh, level 0
  refinement = 1,  ///< what leads from one level to the next: conquest passes, isolated vertices, exactness
};

struct PacketHeader {
  PacketKind kind = PacketKind::base;
  bool last = false;
  std::uint32_t level = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t vertices = 0;  ///< of the finished level, isolated ones included
  std::uint32_t faces = 0;
  std::uint64_t mesh_hash = 0;   ///< of the finished level, see hash.h
  std::uint64_t generation = 0;  ///< content hash of the whole stream, the same in each of its packets
  std::uint32_t crc32c = 0;
};

/// Reads a header from the first bytes of `packet` and checks its form; the payload and the checksum are not looked at.
/// Errors: truncated, bad_magic, unsupported_version, unsupported_feature, corrupt_data.
Result<PacketHeader> parse_packet_header(std::span<const std::byte> packet);

/// The same, and that `packet` is exactly one whole packet whose checksum is right.
/// Errors: also truncated, trailing_bytes, checksum_mismatch.
Result<PacketHeader> check_packet(std::span<const std::byte> packet);

/// Writes the header into the first kPacketHeaderBytes of `packet`, taking payload_bytes from its length, and fills
/// in the checksum. REQUIRES: kPacketHeaderBytes <= packet.size() < 2^32.
void write_packet_header(std::span<std::byte> packet, const PacketHeader& header);

}  // namespace pmcd::codec
