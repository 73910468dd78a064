// SPDX-License-Identifier: MIT
#include "codec/packet/header.h"

#include <array>
#include <string>

#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"

namespace pmcd::codec {
namespace {

constexpr std::array<unsigned char, 4> kPacketMagic = {'P', 'M', 'C', 'P'};
constexpr std::size_t kChecksumOffset = kPacketHeaderBytes - 4;
constexpr std::uint8_t kLastFlag = 1;

std::uint32_t checksum_of(std::span<const std::byte> packet) {
  return crc32c(packet.subspan(kPacketHeaderBytes), crc32c(packet.first(kChecksumOffset)));
}

}  // namespace

Result<PacketHeader> parse_packet_header(std::span<const std::byte> packet) {
  for (std::size_t i = 0; i < kPacketMagic.size() && i < packet.size(); ++i) {
    if (static_cast<unsigned char>(packet[i]) != kPacketMagic[i]) {
      return Error{ErrorCode::bad_magic, i, "this is not a pmcd packet: it does not start with PMCP"};
    }
  }
  if (packet.size() < kPacketHeaderBytes) {
    return Error{ErrorCode::truncated, packet.size(), "a packet header has 48 bytes"};
  }
  ByteReader reader(packet);
  reader.read<std::uint32_t>();
  PacketHeader header;
  const auto version = reader.read<std::uint8_t>();
  if (version != kFormatVersion) {
    return Error{ErrorCode::unsupported_version, version,
                 "the packet has format version " + std::to_string(version) + ", this decoder reads version " +
                     std::to_string(kFormatVersion)};
  }
  const auto kind = reader.read<std::uint8_t>();
  if (kind > static_cast<std::uint8_t>(PacketKind::refinement)) {
    return Error{ErrorCode::unsupported_feature, 5, "unknown packet kind " + std::to_string(kind)};
  }
  header.kind = static_cast<PacketKind>(kind);
  const auto flags = reader.read<std::uint8_t>();
  if ((flags & ~kLastFlag) != 0) return Error{ErrorCode::unsupported_feature, 6, "unknown packet flags"};
  header.last = (flags & kLastFlag) != 0;
  if (reader.read<std::uint8_t>() != 0) return Error{ErrorCode::unsupported_feature, 7, "a reserved byte is not zero"};
  header.level = reader.read<std::uint32_t>();
  header.payload_bytes = reader.read<std::uint32_t>();
  header.vertices = reader.read<std::uint32_t>();
  header.faces = reader.read<std::uint32_t>();
  header.mesh_hash = reader.read<std::uint64_t>();
  header.generation = reader.read<std::uint64_t>();
  if (reader.read<std::uint32_t>() != 0) {
    return Error{ErrorCode::unsupported_feature, 40, "a reserved field is not zero"};
  }
  header.crc32c = reader.read<std::uint32_t>();
  if ((header.kind == PacketKind::base) != (header.level == 0)) {
    return Error{ErrorCode::corrupt_data, 8, "the base packet, and only it, has level 0"};
  }
  return header;
}

Result<PacketHeader> check_packet(std::span<const std::byte> packet) {
  Result<PacketHeader> header = parse_packet_header(packet);
  if (!header) return header;
  const std::uint64_t promised = std::uint64_t{kPacketHeaderBytes} + header->payload_bytes;
  if (packet.size() < promised) {
    return Error{ErrorCode::truncated, packet.size(), "the packet promises " + std::to_string(promised) + " bytes"};
  }
  if (packet.size() > promised) {
    return Error{ErrorCode::trailing_bytes, promised, "bytes after the end of the packet"};
  }
  if (checksum_of(packet) != header->crc32c) {
    return Error{ErrorCode::checksum_mismatch, kChecksumOffset, "the packet was damaged: its checksum differs"};
  }
  return header;
}

void write_packet_header(std::span<std::byte> packet, const PacketHeader& header) {
  std::vector<std::byte> bytes;
  bytes.reserve(kPacketHeaderBytes);
  ByteWriter writer(bytes);
  for (unsigned char c : kPacketMagic) writer.write(static_cast<std::uint8_t>(c));
  writer.write(kFormatVersion);
  writer.write(static_cast<std::uint8_t>(header.kind));
  writer.write(static_cast<std::uint8_t>(header.last ? kLastFlag : 0));
  writer.write(std::uint8_t{0});
  writer.write(header.level);
  writer.write(static_cast<std::uint32_t>(packet.size() - kPacketHeaderBytes));
  writer.write(header.vertices);
  writer.write(header.faces);
  writer.write(header.mesh_hash);
  writer.write(header.generation);
  writer.write(std::uint32_t{0});
  for (std::size_t i = 0; i < bytes.size(); ++i) packet[i] = bytes[i];
  bytes.clear();
  writer.write(checksum_of(packet));
  for (std::size_t i = 0; i < bytes.size(); ++i) packet[kChecksumOffset + i] = bytes[i];
}

}  // namespace pmcd::codec
