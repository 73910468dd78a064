// SPDX-License-Identifier: MIT
// CRC32C (Castagnoli polynomial, reflected, as in iSCSI and ext4): finds transmission and storage errors. Not a
// protection against forgery.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace pmcd::codec {

/// The checksum of `bytes`, continuing from `previous` (0 at the start). Cost: about 1 ns a byte.
std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t previous = 0);

}  // namespace pmcd::codec
