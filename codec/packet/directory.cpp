// SPDX-License-Identifier: MIT
// Layout (little endian): "PMCD", u8 format version, varint bytes that follow, u8 flags (bits 0 to 2: the box's lower
// corner's x, y, z is written, bits 3 to 5 the upper corner's, bit 6: as f64, bit 7: errors are written), the base
// header as in the base packet, u64 generation, the box's coordinates that are not the lattice's (f32, f64 with bit 6),
// then per level varint bytes, varint zigzag of the vertices more than in the level before, varint zigzag of faces - 2
// * vertices, u32 packet CRC32C, with bit 7 u16 error rms, u16 error max (error_value.h); at the end u32 CRC32C of it
// all. What may be left out must be left out.
#include "codec/packet/directory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "codec/packet/base_header.h"
#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/error_value.h"
#include "codec/packet/header.h"

namespace pmcd::codec {
namespace {

constexpr std::array<unsigned char, 4> kDirectoryMagic = {'P', 'M', 'C', 'D'};
constexpr std::size_t kVersionOffset = 4;
constexpr std::size_t kSizeOffset = 5;
constexpr std::size_t kChecksumBytes = 4;
constexpr unsigned kWideBoxFlag = 0x40;
constexpr unsigned kMeasuredFlag = 0x80;
constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();

using Box = std::array<double, 6>;  // lower corner, upper corner

Box box_of(const Directory& directory) {
  const Position& low = directory.box_min;
  const Position& high = directory.box_max;
  return {low[0], low[1], low[2], high[0], high[1], high[2]};
}

// The box as far as the lattice knows it: its origin, which need not be a coordinate of the mesh, rounded to one, and
// its last point. Any, if the lattice is not valid.
Box box_of(const Lattice& lattice) {
  if (!lattice.valid()) return {};
  Box box{};
  const std::int32_t top = lattice.max_index();
  const Position high = lattice.position({top, top, top});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box[axis] = round_to(lattice.scalar, lattice.min[axis]);
    box[3 + axis] = high[axis];
  }
  return box;
}

bool measured(const LevelEntry& entry) {
  return error_code_of(entry.error_rms) != kNotMeasured || error_code_of(entry.error_max) != kNotMeasured;
}

// Which parts the directory has.
unsigned flags_of(const Directory& directory) {
  const Box box = box_of(directory);
  const Box known = box_of(directory.lattice);
  unsigned flags = 0;
  for (unsigned i = 0; i < 6; ++i) {
    if (same_bits(box[i], known[i])) continue;
    flags |= 1u << i;
    if (!is_float32(box[i])) flags |= kWideBoxFlag;
  }
  if (std::any_of(directory.levels.begin(), directory.levels.end(), measured)) flags |= kMeasuredFlag;
  return flags;
}

void append_entry(ByteWriter& writer, const LevelEntry& entry, const LevelEntry& before, bool with_errors) {
  writer.write_varint(entry.bytes);
  writer.write_varint(zigzag(std::int64_t{entry.vertices} - std::int64_t{before.vertices}));
  write_faces(writer, entry.vertices, entry.faces);
  writer.write(static_cast<std::uint8_t>(entry.bits - before.bits));
  writer.write(entry.crc32c);
  if (!with_errors) return;
  writer.write(error_code_of(entry.error_rms));
  writer.write(error_code_of(entry.error_max));
}

// Where and why the next entry is refused.
Status read_entry(ByteReader& reader, const LevelEntry& before, const Directory& directory, bool with_errors,
                  LevelEntry& entry) {
  const std::size_t at = reader.position();
  entry.bytes = static_cast<std::uint32_t>(reader.read_varint(kMost32));
  const std::int64_t vertices = std::int64_t{before.vertices} + unzigzag(reader.read_varint());
  const bool countable = vertices >= 0 && vertices <= static_cast<std::int64_t>(kMost32);
  entry.vertices = countable ? static_cast<std::uint32_t>(vertices) : 0;
  const std::optional<std::uint32_t> faces = read_faces(reader, entry.vertices);
  entry.faces = faces.value_or(0);
  const unsigned bits = unsigned{before.bits} + reader.read<std::uint8_t>();
  entry.crc32c = reader.read<std::uint32_t>();
  if (with_errors) {
    entry.error_rms = error_of_code(reader.read<std::uint16_t>());
    entry.error_max = error_of_code(reader.read<std::uint16_t>());
  }
  if (reader.malformed_at()) {
    return Error{ErrorCode::corrupt_data, *reader.malformed_at(),
                 "a number in the directory is out of range or longer than it needs to be"};
  }
  if (!reader.ok()) return Error{ErrorCode::corrupt_data, at, "the directory ends within a level"};
  if (!countable || !faces || entry.bytes < kLeastHeaderBytes || bits < 1 || bits > directory.lattice.bits) {
    return Error{ErrorCode::corrupt_data, at, "a directory entry makes no sense"};
  }
  entry.bits = static_cast<std::uint8_t>(bits);
  return {};
}

Error out_of_order(std::uint32_t level) {
  return {ErrorCode::out_of_order, level, "packets do not stand in the order of their levels"};
}

Status check_entry(std::span<const std::byte> packet, const LevelEntry& entry, std::uint32_t level,
                   const Directory& directory) {
  Result<PacketHeader> header = check_packet(packet);
  if (!header) return header.error();
  if (header->level != level) return out_of_order(header->level);
  if (!header->is_of(directory.generation)) {
    return Error{ErrorCode::wrong_mesh, level, "a packet belongs to another mesh or another encoding of it"};
  }
  if (header->last != (level + 1 == directory.levels.size())) {
    return Error{ErrorCode::corrupt_data, level, "the last packet is not where the directory ends"};
  }
  if (header->vertices != entry.vertices || header->faces != entry.faces || header->crc32c != entry.crc32c ||
      header->missing_digits + unsigned{entry.bits} != directory.lattice.bits) {
    return Error{ErrorCode::corrupt_data, level, "directory and packet disagree on level " + std::to_string(level)};
  }
  return {};
}

}  // namespace

Result<Directory> make_directory(std::span<const std::span<const std::byte>> packets) {
  Directory directory;
  directory.format_version = kFormatVersion;
  if (packets.empty()) return Error{ErrorCode::truncated, 0, "a mesh has at least its base packet"};
  std::vector<PacketHeader> headers;
  for (const std::span<const std::byte> packet : packets) {
    Result<PacketHeader> header = check_packet(packet);
    if (!header) return header.error();
    headers.push_back(*header);
  }
  if (!headers[0].is_base()) return out_of_order(headers[0].level);
  Result<BaseHeader> base = parse_base_header(packets[0].subspan(headers[0].size));
  if (!base) return base.error();
  directory.lattice = base->lattice;
  directory.lossless = base->lossless;
  directory.generation = headers[0].generation;
  directory.levels.resize(packets.size());
  unsigned missing_before = directory.lattice.bits - 1;
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const PacketHeader& header = headers[k];
    LevelEntry& entry = directory.levels[k];
    entry.bytes = static_cast<std::uint32_t>(packets[k].size());
    entry.vertices = header.vertices;
    entry.faces = header.faces;
    entry.bits = static_cast<std::uint8_t>(directory.lattice.bits - header.missing_digits);
    entry.crc32c = header.crc32c;
    Status status = check_entry(packets[k], entry, static_cast<std::uint32_t>(k), directory);
    if (!status) return status.error();
    if (header.missing_digits > missing_before) {
      return Error{ErrorCode::corrupt_data, k, "level " + std::to_string(k) + " lacks more digits than it can"};
    }
    missing_before = header.missing_digits;
  }
  const Box box = box_of(directory.lattice);
  directory.box_min = {box[0], box[1], box[2]};
  directory.box_max = {box[3], box[4], box[5]};
  return directory;
}

std::vector<std::byte> serialize(const Directory& directory) {
  const unsigned flags = flags_of(directory);
  std::vector<std::byte> content;
  ByteWriter writer(content);
  writer.write(static_cast<std::uint8_t>(flags));
  append_base_header(content, directory.lattice, directory.lossless);
  writer.write(directory.generation);
  const Box box = box_of(directory);
  for (unsigned i = 0; i < 6; ++i) {
    if ((flags & (1u << i)) == 0) continue;
    if ((flags & kWideBoxFlag) != 0) {
      writer.write_double(box[i]);
    } else {
      writer.write_float(box[i]);
    }
  }
  LevelEntry before;
  for (const LevelEntry& entry : directory.levels) {
    append_entry(writer, entry, before, (flags & kMeasuredFlag) != 0);
    before = entry;
  }
  std::vector<std::byte> bytes;
  ByteWriter whole(bytes);
  for (unsigned char c : kDirectoryMagic) whole.write(static_cast<std::uint8_t>(c));
  whole.write(directory.format_version);
  whole.write_varint(content.size() + kChecksumBytes);
  bytes.insert(bytes.end(), content.begin(), content.end());
  whole.write(crc32c(bytes));
  return bytes;
}

namespace {

// What stands between the number of bytes and the checksum; `start` is where in the file, for errors.
Status parse_content(std::span<const std::byte> head_and_content, std::size_t start, Directory& directory) {
  ByteReader reader(head_and_content);
  reader.skip(start);
  const unsigned flags = reader.read<std::uint8_t>();
  Result<BaseHeader> base = parse_base_header(head_and_content.subspan(reader.position()));
  if (!base) {
    Error error = base.error();
    error.where += reader.position();
    if (error.code == ErrorCode::truncated) error.code = ErrorCode::corrupt_data;  // the file has more
    error.detail = "in the directory: " + error.detail;
    return error;
  }
  directory.lattice = base->lattice;
  directory.lossless = base->lossless;
  reader.skip(base->size);
  directory.generation = reader.read<std::uint64_t>();
  const std::size_t box_at = reader.position();
  Box box = box_of(directory.lattice);
  for (unsigned i = 0; i < 6; ++i) {
    if ((flags & (1u << i)) != 0) box[i] = (flags & kWideBoxFlag) != 0 ? reader.read_double() : reader.read_float();
    if (!std::isfinite(box[i])) {
      return Error{ErrorCode::corrupt_data, box_at, "the directory's bounding box makes no sense"};
    }
  }
  if (!reader.ok()) return Error{ErrorCode::corrupt_data, box_at, "the directory ends within its bounding box"};
  directory.box_min = {box[0], box[1], box[2]};
  directory.box_max = {box[3], box[4], box[5]};
  while (reader.position() < head_and_content.size()) {
    LevelEntry entry;
    const LevelEntry before = directory.levels.empty() ? LevelEntry{} : directory.levels.back();
    Status status = read_entry(reader, before, directory, (flags & kMeasuredFlag) != 0, entry);
    if (!status) return status;
    directory.levels.push_back(entry);
  }
  if (directory.levels.empty()) {
    return Error{ErrorCode::corrupt_data, head_and_content.size(), "a mesh has at least one level"};
  }
  if (directory.levels.back().bits != directory.lattice.bits) {
    return Error{ErrorCode::corrupt_data, head_and_content.size(), "the last level lacks digits of its positions"};
  }
  if (flags != flags_of(directory)) {
    return Error{ErrorCode::corrupt_data, start, "the directory is not in its shortest form"};
  }
  return {};
}

}  // namespace

Result<ParsedDirectory> parse_directory(std::span<const std::byte> file) {
  const Error truncated{ErrorCode::truncated, file.size(), "the file ends within its directory"};
  for (std::size_t i = 0; i < kDirectoryMagic.size() && i < file.size(); ++i) {
    if (static_cast<unsigned char>(file[i]) != kDirectoryMagic[i]) {
      return Error{ErrorCode::bad_magic, i, "this is not a .pmcd file: it does not start with PMCD"};
    }
  }
  if (file.size() <= kVersionOffset) return truncated;
  ByteReader reader(file);
  reader.skip(kVersionOffset);
  ParsedDirectory parsed;
  Directory& directory = parsed.directory;
  directory.format_version = reader.read<std::uint8_t>();
  if (directory.format_version != kFormatVersion) {
    return Error{ErrorCode::unsupported_version, directory.format_version,
                 "the file has format version " + std::to_string(directory.format_version) +
                     ", this program reads version " + std::to_string(kFormatVersion)};
  }
  const std::uint64_t rest = reader.read_varint();
  if (reader.malformed_at() || (reader.ok() && rest < kChecksumBytes)) {
    return Error{ErrorCode::corrupt_data, kSizeOffset, "the directory's number of bytes makes no sense"};
  }
  if (!reader.ok()) return truncated;
  const std::size_t start = reader.position();
  if (rest > file.size() - start) {
    return Error{ErrorCode::truncated, file.size(),
                 "the directory promises " + std::to_string(rest) + " bytes more, the file has " +
                     std::to_string(file.size() - start)};
  }
  parsed.size = start + static_cast<std::size_t>(rest);
  // The checksum comes before the content: what a flipped bit says is not worth explaining.
  const std::size_t checksum_at = parsed.size - kChecksumBytes;
  ByteReader checksum(file.subspan(checksum_at));
  if (checksum.read<std::uint32_t>() != crc32c(file.first(checksum_at))) {
    return Error{ErrorCode::checksum_mismatch, checksum_at, "the directory was damaged: its checksum differs"};
  }
  Status status = parse_content(file.first(checksum_at), start, directory);
  if (!status) return status.error();
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
