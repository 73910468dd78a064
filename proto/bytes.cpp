// SPDX-License-Identifier: MIT
// The cursor and the buffer of bytes.h. Bytes are composed by shifts, so the host's byte order does not matter.
#include "proto/bytes.h"

#include <algorithm>
#include <bit>

namespace pmcd::proto {

std::uint64_t ByteReader::little_endian(std::size_t width) {
  const ByteView from = bytes(width);
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < from.size(); ++i) value |= std::to_integer<std::uint64_t>(from[i]) << (8 * i);
  return value;
}

std::uint8_t ByteReader::u8() {
  return static_cast<std::uint8_t>(little_endian(1));
}
std::uint16_t ByteReader::u16() {
  return static_cast<std::uint16_t>(little_endian(2));
}
std::uint32_t ByteReader::u32() {
  return static_cast<std::uint32_t>(little_endian(4));
}
std::uint64_t ByteReader::u64() {
  return little_endian(8);
}
double ByteReader::f64() {
  return std::bit_cast<double>(u64());
}

ByteView ByteReader::bytes(std::size_t count) {
  if (failed_ || count > left()) {
    failed_ = true;
    return {};
  }
  const ByteView out = bytes_.subspan(position_, count);
  position_ += count;
  return out;
}

ByteView ByteReader::rest() {
  return bytes(left());
}

namespace {
std::string to_string(ByteView bytes) {
  std::string out(bytes.size(), '\0');
  std::transform(bytes.begin(), bytes.end(), out.begin(), [](std::byte b) { return static_cast<char>(b); });
  return out;
}
}  // namespace

std::string ByteReader::str8() {
  const std::size_t length = u8();
  return to_string(bytes(length));
}

std::string ByteReader::str16() {
  const std::size_t length = u16();
  return to_string(bytes(length));
}

void ByteWriter::little_endian(std::uint64_t value, std::size_t width) {
  for (std::size_t i = 0; i < width; ++i) out_.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xff));
}

void ByteWriter::f64(double value) {
  u64(std::bit_cast<std::uint64_t>(value));
}

void ByteWriter::bytes(ByteView value) {
  out_.insert(out_.end(), value.begin(), value.end());
}

void ByteWriter::str8(std::string_view value) {
  const std::string_view cut = value.substr(0, 0xff);
  u8(static_cast<std::uint8_t>(cut.size()));
  bytes(as_bytes(cut));
}

void ByteWriter::str16(std::string_view value) {
  const std::string_view cut = value.substr(0, 0xffff);
  u16(static_cast<std::uint16_t>(cut.size()));
  bytes(as_bytes(cut));
}

ByteView as_bytes(std::string_view text) {
  return std::as_bytes(std::span<const char>(text.data(), text.size()));
}

}  // namespace pmcd::proto
