// SPDX-License-Identifier: MIT
// UTF-8 read by code point, and the rules of text.h on top of it.
#include "proto/text.h"

#include <cstdint>

namespace pmcd::proto {

namespace {

struct CodePoint {
  std::uint32_t value = 0;
  std::size_t bytes = 0;  ///< 0: not UTF-8
};

CodePoint read_code_point(std::string_view text) {
  const auto byte_at = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte_at(0);
  if (first < 0x80) return {first, 1};
  std::size_t bytes = 0;
  std::uint32_t value = 0;
  std::uint32_t smallest = 0;
  if ((first & 0xe0) == 0xc0) {
    bytes = 2, value = first & 0x1fu, smallest = 0x80;
  } else if ((first & 0xf0) == 0xe0) {
    bytes = 3, value = first & 0x0fu, smallest = 0x800;
  } else if ((first & 0xf8) == 0xf0) {
    bytes = 4, value = first & 0x07u, smallest = 0x10000;
  } else {
    return {};
  }
  if (text.size() < bytes) return {};
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte_at(i) & 0xc0) != 0x80) return {};
    value = (value << 6) | (byte_at(i) & 0x3fu);
  }
  const bool surrogate = value >= 0xd800 && value <= 0xdfff;
  if (value < smallest || value > 0x10ffff || surrogate) return {};
  return {value, bytes};
}

bool is_printable(std::uint32_t c) {
  if (c < 0x20 || (c >= 0x7f && c <= 0x9f)) return false;       // C0, DEL, C1
  if (c == 0x061c || c == 0x200e || c == 0x200f) return false;  // marks of direction
  if (c >= 0x2028 && c <= 0x202e) return false;                 // separators, bidirectional embeddings and overrides
  if (c >= 0x2066 && c <= 0x2069) return false;                 // isolates
  return c != 0xfeff && (c & 0xfffe) != 0xfffe;                 // byte-order mark, non-characters
}

}  // namespace

bool is_printable_utf8(std::string_view text) {
  while (!text.empty()) {
    const CodePoint point = read_code_point(text);
    if (point.bytes == 0 || !is_printable(point.value)) return false;
    text.remove_prefix(point.bytes);
  }
  return true;
}

bool is_mesh_name(std::string_view name) {
  if (name.empty() || name.size() > kMaxNameBytes) return false;
  if (name == "." || name == ".." || name.front() == ' ' || name.back() == ' ') return false;
  return name.find('/') == std::string_view::npos && is_printable_utf8(name);
}

std::string printable(std::string_view text, std::size_t max_bytes) {
  std::string out;
  while (!text.empty()) {
    const CodePoint point = read_code_point(text);
    const bool good = point.bytes != 0 && is_printable(point.value);
    const std::size_t taken = point.bytes == 0 ? 1 : point.bytes;
    const std::string_view piece = good ? text.substr(0, taken) : std::string_view("?");
    if (out.size() + piece.size() > max_bytes) break;
    out += piece;
    text.remove_prefix(taken);
  }
  return out;
}

}  // namespace pmcd::proto
