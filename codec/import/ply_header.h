// SPDX-License-Identifier: GPL-3.0-or-later
// The header of a PLY file: which elements, how many of each and with which properties. Reads no element.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codec/import/error.h"

namespace pmcd::import {

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t ply_type_bytes(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;  ///< of the value, or of a list's items
  bool is_list = false;
  PlyType count_type = PlyType::uint8;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding : std::uint8_t { ascii, binary_little_endian, binary_big_endian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::size_t size = 0;  ///< bytes; the first element starts here
};

/// Errors: wrong_format, unsupported_variant, truncated, malformed.
ImportResult<PlyHeader> parse_ply_header(std::span<const std::byte> bytes);

}  // namespace pmcd::import
