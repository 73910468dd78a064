// SPDX-License-Identifier: MIT
#include "codec/packet/header.h"

#include <algorithm>
#include <limits>
#include <string>

#include "codec/lattice/lattice.h"
#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"

namespace pmcd::codec {
namespace {

constexpr std::uint8_t kLastFlag = 1;
constexpr unsigned kMissingShift = 1;
constexpr unsigned kMissingMask = 7;
constexpr unsigned kManyMissing = kMissingMask;  // so many or more: a byte of their own says
constexpr unsigned kVersionShift = 4;
constexpr std::uint64_t kMostU32 = std::numeric_limits<std::uint32_t>::max();
static_assert(kFormatVersion < 16);

// What of hash and generation stands where: whole in the one packet that is the last word on it.
constexpr std::size_t hash_bytes(bool last) {
  return last ? 8 : 3;
}
constexpr std::size_t generation_bytes(bool base) {
  return base ? 8 : 2;
}
constexpr std::uint64_t low_bytes(std::uint64_t value, std::size_t bytes) {
  return bytes == 8 ? value : value & ((std::uint64_t{1} << (8 * bytes)) - 1);
}

std::uint64_t read_bytes(ByteReader& reader, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::uint64_t{reader.read<std::uint8_t>()} << (8 * i);
  return value;
}

void write_bytes(ByteWriter& writer, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) writer.write(static_cast<std::uint8_t>((value >> (8 * i)) & 0xFF));
}

std::uint32_t checksum_of(std::span<const std::byte> packet) {
  return crc32c(packet.subspan(kHeaderNumbersOffset), crc32c(packet.first(kHeaderChecksumOffset)));
}

}  // namespace

bool PacketHeader::is_of(std::uint64_t whole_generation) const {
  return low_bytes(generation ^ whole_generation, generation_bytes(is_base())) == 0;
}

bool PacketHeader::proves(std::uint64_t whole_hash) const {
  return low_bytes(mesh_hash ^ whole_hash, hash_bytes(last)) == 0;
}

void write_faces(ByteWriter& writer, std::uint32_t vertices, std::uint32_t faces) {
  writer.write_varint(zigzag(std::int64_t{faces} - 2 * std::int64_t{vertices}));
}

std::optional<std::uint32_t> read_faces(ByteReader& reader, std::uint32_t vertices) {
  const std::int64_t faces = 2 * std::int64_t{vertices} + unzigzag(reader.read_varint());
  if (!reader.ok() || faces < 0 || faces > static_cast<std::int64_t>(kMostU32)) return std::nullopt;
  return static_cast<std::uint32_t>(faces);
}

Result<PacketHeader> parse_packet_header(std::span<const std::byte> packet) {
  const Error truncated{ErrorCode::truncated, packet.size(), "the packet ends within its header"};
  if (packet.empty()) return truncated;
  ByteReader reader(packet);
  if (reader.read<std::uint8_t>() != kPacketMagic) {
    return Error{ErrorCode::bad_magic, 0, "this is not a pmcd packet: it does not start with the byte 9b"};
  }
  if (packet.size() < 2) return truncated;
  const auto flags = reader.read<std::uint8_t>();
  const unsigned version = flags >> kVersionShift;
  if (version != kFormatVersion) {
    return Error{ErrorCode::unsupported_version, version,
                 "the packet has format version " + std::to_string(version) + ", this decoder reads version " +
                     std::to_string(kFormatVersion)};
  }
  PacketHeader header;
  header.last = (flags & kLastFlag) != 0;
  header.missing_digits = (flags >> kMissingShift) & kMissingMask;
  if (header.last && header.missing_digits > 0) {
    return Error{ErrorCode::corrupt_data, kHeaderFlagsOffset, "the last level lacks digits of its positions"};
  }
  header.crc32c = reader.read<std::uint32_t>();
  header.level = static_cast<std::uint32_t>(reader.read_varint(kMostU32));
  header.payload_bytes = static_cast<std::uint32_t>(reader.read_varint(kMostU32 - kMostHeaderBytes));
  header.vertices = static_cast<std::uint32_t>(reader.read_varint(kMostU32));
  const std::size_t faces_at = reader.position();
  const std::optional<std::uint32_t> faces = read_faces(reader, header.vertices);
  if (reader.malformed_at()) {
    return Error{ErrorCode::corrupt_data, *reader.malformed_at(),
                 "a number in the packet header is out of range or longer than it needs to be"};
  }
  if (!reader.ok()) return truncated;
  if (!faces) return Error{ErrorCode::corrupt_data, faces_at, "the number of faces is out of range"};
  header.faces = *faces;
  if (header.missing_digits == kManyMissing) {
    const std::size_t digits_at = reader.position();
    header.missing_digits = reader.read<std::uint8_t>();
    if (!reader.ok()) return truncated;
    if (header.missing_digits < kManyMissing || header.missing_digits >= kMaxLatticeBits) {
      return Error{ErrorCode::corrupt_data, digits_at, "the number of missing digits is out of range"};
    }
  }
  header.mesh_hash = read_bytes(reader, hash_bytes(header.last));
  header.generation = read_bytes(reader, generation_bytes(header.is_base()));
  if (!reader.ok()) return truncated;
  header.size = reader.position();
  return header;
}

Result<PacketHeader> check_packet(std::span<const std::byte> packet) {
  Result<PacketHeader> header = parse_packet_header(packet);
  if (!header) return header;
  const std::uint64_t promised = std::uint64_t{header->size} + header->payload_bytes;
  if (packet.size() < promised) {
    return Error{ErrorCode::truncated, packet.size(), "the packet promises " + std::to_string(promised) + " bytes"};
  }
  if (packet.size() > promised) {
    return Error{ErrorCode::trailing_bytes, promised, "bytes after the end of the packet"};
  }
  if (checksum_of(packet) != header->crc32c) {
    return Error{ErrorCode::checksum_mismatch, kHeaderChecksumOffset, "the packet was damaged: its checksum differs"};
  }
  return header;
}

std::vector<std::byte> make_packet(const PacketHeader& header, std::span<const std::byte> payload) {
  std::vector<std::byte> packet;
  packet.reserve(kMostHeaderBytes + payload.size());
  ByteWriter writer(packet);
  writer.write(kPacketMagic);
  const unsigned missing = std::min<unsigned>(header.missing_digits, kManyMissing);
  writer.write(static_cast<std::uint8_t>((kFormatVersion << kVersionShift) | (missing << kMissingShift) |
                                         (header.last ? kLastFlag : 0)));
  writer.write(std::uint32_t{0});  // the checksum, when all else stands
  writer.write_varint(header.level);
  writer.write_varint(payload.size());
  writer.write_varint(header.vertices);
  write_faces(writer, header.vertices, header.faces);
  if (missing == kManyMissing) writer.write(header.missing_digits);
  write_bytes(writer, header.mesh_hash, hash_bytes(header.last));
  write_bytes(writer, header.generation, generation_bytes(header.is_base()));
  packet.insert(packet.end(), payload.begin(), payload.end());
  const std::uint32_t checksum = checksum_of(packet);
  for (std::size_t i = 0; i < 4; ++i)
    packet[kHeaderChecksumOffset + i] = static_cast<std::byte>((checksum >> (8 * i)) & 0xFF);
  return packet;
}

}  // namespace pmcd::codec
