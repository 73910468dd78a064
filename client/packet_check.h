// SPDX-License-Identifier: MIT
// Whether bytes are the packet that a directory announces. Not part of the library's public face.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "proto/bytes.h"

namespace pmcd::client {

/// What is wrong with the bytes as packet `number` of that directory; nullopt if nothing is. Reads all bytes once.
/// REQUIRES: the directory has that packet.
inline std::optional<std::string> wrong_with_packet(const codec::Directory& directory, std::uint32_t number,
                                                    proto::ByteView bytes) {
  const auto header = codec::check_packet(bytes);
  if (!header) return header.error().detail;
  if (header->level != number) return "it is of level " + std::to_string(header->level);
  if (!header->is_of(directory.generation)) return "it is of another generation";
  if (header->crc32c != directory.levels[number].crc32c) return "its checksum is not the directory's";
  return std::nullopt;
}

}  // namespace pmcd::client
