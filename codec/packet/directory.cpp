// SPDX-License-Identifier: MIT
// Layout (little endian): "PMCD", u8 format version, u8 flags (bit 0 lossless, bit 1 float64), u8 lattice bits, u8 0,
// u32 number of levels, u64 generation, f64 lattice min[3], f64 step, f64 box min[3], f64 box max[3], then per level
// u32 bytes, u32 vertices, u32 faces, u32 packet CRC32C, f64 error rms, f64 error max; at the end u32 CRC32C of it all.
#include "codec/packet/directory.h"

#include <array>
#include <cmath>
#include <string>

#include "codec/packet/base_header.h"
#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/header.h"

namespace pmcd::codec {
namespace {

constexpr std::array<unsigned char, 4> kDirectoryMagic = {'P', 'M', 'C', 'D'};
constexpr std::size_t kFixedBytes = 4 + 4 + 4 + 8 + 10 * 8;
constexpr std::size_t kEntryBytes = 4 * 4 + 2 * 8;
constexpr std::size_t kChecksumBytes = 4;
constexpr std::uint8_t kLosslessFlag = 1;
constexpr std::uint8_t kFloat64Flag = 2;

bool is_error_value(double value) {
  return std::isfinite(value) && (value >= 0 || value == -1);
}

Status check_entry(std::span<const std::byte> packet, const LevelEntry& entry, std::uint32_t level,
                   const Directory& directory) {
  Result<PacketHeader> header = check_packet(packet);
  if (!header) return header.error();
  if (header->level != level) {
    return Error{ErrorCode::out_of_order, header->level, "packets do not stand in the order of their levels"};
  }
  if (header->generation != directory.generation) {
    return Error{ErrorCode::wrong_mesh, level, "a packet belongs to another mesh or another encoding of it"};
  }
  if (header->last != (level + 1 == directory.levels.size())) {
    return Error{ErrorCode::corrupt_data, level, "the last packet is not where the directory ends"};
  }
  if (header->vertices != entry.vertices || header->faces != entry.faces || header->crc32c != entry.crc32c) {
    return Error{ErrorCode::corrupt_data, level, "directory and packet disagree on level " + std::to_string(level)};
  }
  return {};
}

}  // namespace

Result<Directory> make_directory(std::span<const std::span<const std::byte>> packets) {
  Directory directory;
  directory.format_version = kFormatVersion;
  if (packets.empty()) return Error{ErrorCode::truncated, 0, "a mesh has at least its base packet"};
  for (const std::span<const std::byte> packet : packets) {
    Result<PacketHeader> header = check_packet(packet);
    if (!header) return header.error();
    LevelEntry entry;
    entry.bytes = static_cast<std::uint32_t>(packet.size());
    entry.vertices = header->vertices;
    entry.faces = header->faces;
    entry.crc32c = header->crc32c;
    if (directory.levels.empty()) directory.generation = header->generation;
    directory.levels.push_back(entry);
  }
  for (std::size_t k = 0; k < packets.size(); ++k) {
    Status status = check_entry(packets[k], directory.levels[k], static_cast<std::uint32_t>(k), directory);
    if (!status) return status.error();
  }
  Result<BaseHeader> base = parse_base_header(packets[0].subspan(kPacketHeaderBytes));
  if (!base) return base.error();
  directory.lattice = base->lattice;
  directory.lossless = base->lossless;
  directory.box_min = directory.lattice.min;
  const std::int32_t top = directory.lattice.max_index();
  directory.box_max = directory.lattice.position({top, top, top});
  return directory;
}

std::vector<std::byte> serialize(const Directory& directory) {
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  for (unsigned char c : kDirectoryMagic) writer.write(static_cast<std::uint8_t>(c));
  writer.write(directory.format_version);
  writer.write(static_cast<std::uint8_t>((directory.lossless ? kLosslessFlag : 0) |
                                         (directory.lattice.scalar == Scalar::float64 ? kFloat64Flag : 0)));
  writer.write(static_cast<std::uint8_t>(directory.lattice.bits));
  writer.write(std::uint8_t{0});
  writer.write(static_cast<std::uint32_t>(directory.levels.size()));
  writer.write(directory.generation);
  for (double value : directory.lattice.min) writer.write_double(value);
  writer.write_double(directory.lattice.step);
  for (double value : directory.box_min) writer.write_double(value);
  for (double value : directory.box_max) writer.write_double(value);
  for (const LevelEntry& entry : directory.levels) {
    writer.write(entry.bytes);
    writer.write(entry.vertices);
    writer.write(entry.faces);
    writer.write(entry.crc32c);
    writer.write_double(entry.error_rms);
    writer.write_double(entry.error_max);
  }
  writer.write(crc32c(bytes));
  return bytes;
}

Result<ParsedDirectory> parse_directory(std::span<const std::byte> file) {
  for (std::size_t i = 0; i < kDirectoryMagic.size() && i < file.size(); ++i) {
    if (static_cast<unsigned char>(file[i]) != kDirectoryMagic[i]) {
      return Error{ErrorCode::bad_magic, i, "this is not a .pmcd file: it does not start with PMCD"};
    }
  }
  if (file.size() < kFixedBytes + kChecksumBytes) {
    return Error{ErrorCode::truncated, file.size(), "the file ends within its directory"};
  }
  ByteReader reader(file);
  reader.read<std::uint32_t>();
  ParsedDirectory parsed;
  Directory& directory = parsed.directory;
  directory.format_version = reader.read<std::uint8_t>();
  if (directory.format_version != kFormatVersion) {
    return Error{ErrorCode::unsupported_version, directory.format_version,
                 "the file has format version " + std::to_string(directory.format_version) +
                     ", this program reads version " + std::to_string(kFormatVersion)};
  }
  const auto flags = reader.read<std::uint8_t>();
  const auto bits = reader.read<std::uint8_t>();
  const auto reserved = reader.read<std::uint8_t>();
  const auto levels = reader.read<std::uint32_t>();
  const std::size_t most = (file.size() - kFixedBytes - kChecksumBytes) / kEntryBytes;
  if (levels > most) {
    return Error{
        ErrorCode::truncated, file.size(),
        "the directory promises " + std::to_string(levels) + " levels, the file has room for " + std::to_string(most)};
  }
  parsed.size = kFixedBytes + levels * kEntryBytes + kChecksumBytes;
  // The checksum comes before the content: what a flipped bit says is not worth explaining.
  ByteReader checksum(file.subspan(parsed.size - kChecksumBytes));
  if (checksum.read<std::uint32_t>() != crc32c(file.first(parsed.size - kChecksumBytes))) {
    return Error{ErrorCode::checksum_mismatch, parsed.size - kChecksumBytes,
                 "the directory was damaged: its checksum differs"};
  }
  if ((flags & ~(kLosslessFlag | kFloat64Flag)) != 0 || reserved != 0) {
    return Error{ErrorCode::unsupported_feature, 5, "unknown flags in the directory"};
  }
  directory.lossless = (flags & kLosslessFlag) != 0;
  directory.generation = reader.read<std::uint64_t>();
  directory.lattice.scalar = (flags & kFloat64Flag) != 0 ? Scalar::float64 : Scalar::float32;
  directory.lattice.bits = bits;
  for (double& value : directory.lattice.min) value = reader.read_double();
  directory.lattice.step = reader.read_double();
  for (double& value : directory.box_min) value = reader.read_double();
  for (double& value : directory.box_max) value = reader.read_double();
  if (!directory.lattice.valid()) return Error{ErrorCode::corrupt_data, 6, "the directory's lattice makes no sense"};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (!std::isfinite(directory.box_min[a]) || !std::isfinite(directory.box_max[a])) {
      return Error{ErrorCode::corrupt_data, 52, "the directory's bounding box makes no sense"};
    }
  }
  if (levels == 0) return Error{ErrorCode::corrupt_data, 8, "a mesh has at least one level"};
  directory.levels.resize(levels);
  for (LevelEntry& entry : directory.levels) {
    const std::size_t at = reader.position();
    entry.bytes = reader.read<std::uint32_t>();
    entry.vertices = reader.read<std::uint32_t>();
    entry.faces = reader.read<std::uint32_t>();
    entry.crc32c = reader.read<std::uint32_t>();
    entry.error_rms = reader.read_double();
    entry.error_max = reader.read_double();
    if (entry.bytes < kPacketHeaderBytes || !is_error_value(entry.error_rms) || !is_error_value(entry.error_max)) {
      return Error{ErrorCode::corrupt_data, at, "a directory entry makes no sense"};
    }
  }
  return parsed;
}

Result<ParsedFile> parse_file(std::span<const std::byte> file) {
  Result<ParsedDirectory> parsed = parse_directory(file);
  if (!parsed) return parsed.error();
  ParsedFile result;
  result.directory = std::move(parsed->directory);
  std::size_t at = parsed->size;
  result.packets.reserve(result.directory.levels.size());
  for (std::size_t k = 0; k < result.directory.levels.size(); ++k) {
    const LevelEntry& entry = result.directory.levels[k];
    if (entry.bytes > file.size() - at) {
      return Error{ErrorCode::truncated, file.size(), "the file ends within packet " + std::to_string(k)};
    }
    const auto packet = file.subspan(at, entry.bytes);
    Status status = check_entry(packet, entry, static_cast<std::uint32_t>(k), result.directory);
    if (!status) {
      Error error = status.error();
      error.detail = "packet " + std::to_string(k) + " at byte " + std::to_string(at) + ": " + error.detail;
      return error;
    }
    result.packets.push_back(packet);
    at += entry.bytes;
  }
  if (at != file.size()) return Error{ErrorCode::trailing_bytes, at, "bytes after the last packet"};
  return result;
}

}  // namespace pmcd::codec
