// SPDX-License-Identifier: MIT
// What may enter the database: packets that are what their directory says. Looks at packet headers and checksums; only
// a decoder can tell whether the payloads are right, and the ingester has run one.
#include <string>

#include "codec/packet/header.h"
#include "daemon/store/mesh_store.h"

namespace pmcd::store {
namespace {

/// A sentence on packet `level` if it is not what `entry` promises; empty if it is.
std::string packet_fault(std::span<const std::byte> packet, const codec::LevelEntry& entry, std::uint32_t level,
                         bool last, const codec::Directory& directory) {
  const auto checked = codec::check_packet(packet);
  if (!checked) return std::string(codec::error_name(checked.error().code)) + ": " + checked.error().detail;
  const codec::PacketHeader& header = checked.value();
  if (header.level != level) return "its header says level " + std::to_string(header.level);
  if (header.last != last) return last ? "it is not marked as the last" : "it is marked as the last";
  if (!header.is_of(directory.generation)) return "it belongs to another mesh";
  if (packet.size() != entry.bytes) {
    return "it has " + std::to_string(packet.size()) + " bytes, the directory says " + std::to_string(entry.bytes);
  }
  if (header.vertices != entry.vertices || header.faces != entry.faces) return "its counts are not the directory's";
  if (header.missing_digits + unsigned{entry.bits} != directory.lattice.bits) {
    return "its precision is not the directory's";
  }
  if (header.crc32c != entry.crc32c) return "its checksum is not the directory's";
  return {};
}

}  // namespace

Status check_name(std::string_view name) {
  if (name.empty()) return Error{ErrorCode::bad_name, "a mesh name must not be empty"};
  if (name.size() > kMaxNameBytes) {
    return Error{ErrorCode::bad_name, "a mesh name has at most " + std::to_string(kMaxNameBytes) + " bytes, this one " +
                                          std::to_string(name.size())};
  }
  return Done{};
}

Status check_directory(const codec::Directory& directory) {
  if (directory.levels.empty()) return Error{ErrorCode::bad_directory, "the directory has no level"};
  if (directory.levels.size() > kMaxLevels) {
    return Error{ErrorCode::too_large, "the directory has " + std::to_string(directory.levels.size()) +
                                           " levels, at most " + std::to_string(kMaxLevels) + " are stored"};
  }
  if (directory.format_version != codec::kFormatVersion) {
    return Error{ErrorCode::bad_directory, "packet format version " + std::to_string(directory.format_version) +
                                               ", this pmcd stores version " + std::to_string(codec::kFormatVersion)};
  }
  for (std::size_t level = 0; level < directory.levels.size(); ++level) {
    if (directory.levels[level].bytes > kMaxPacketBytes) {
      return Error{ErrorCode::too_large, "packet " + std::to_string(level) + " has " +
                                             std::to_string(directory.levels[level].bytes) + " bytes, at most " +
                                             std::to_string(kMaxPacketBytes) + " are stored"};
    }
  }
  return Done{};
}

Status check_mesh(const codec::Directory& directory, std::span<const std::span<const std::byte>> packets) {
  if (Status status = check_directory(directory); !status.ok()) return status;
  if (packets.size() != directory.levels.size()) {
    return Error{ErrorCode::bad_packet, std::to_string(packets.size()) + " packets came, the directory has " +
                                            std::to_string(directory.levels.size()) + " levels"};
  }
  for (std::size_t level = 0; level < packets.size(); ++level) {
    const std::string fault = packet_fault(packets[level], directory.levels[level], static_cast<std::uint32_t>(level),
                                           level + 1 == packets.size(), directory);
    if (!fault.empty()) return Error{ErrorCode::bad_packet, "packet " + std::to_string(level) + ": " + fault};
  }
  return Done{};
}

}  // namespace pmcd::store
