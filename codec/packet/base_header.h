// SPDX-License-Identifier: MIT
// The fixed part at the start of the base packet's payload: what holds for the whole mesh. The coded base mesh follows.
// Layout (little endian): u8 lattice bits, u8 flags (bit 0 lossless, bit 1 float64, bit 2 a lattice of multiples, bit 3
// an exact one), then min[3] as f32 (f64 if float64) and f64 step; or, with bit 2, u8 multiple and u16 exponent of the
// unit (two's complement) and origin[3] as whole numbers: twice the magnitude, one more if negative, in groups of 7
// bits from the lowest, bit 7 set in all but the last.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "codec/lattice/lattice.h"
#include "codec/result.h"

namespace pmcd::codec {

struct BaseHeader {
  Lattice lattice;
  bool lossless = false;
  std::size_t size = 0;  ///< bytes that it takes
};

/// Errors: truncated, unsupported_feature, corrupt_data (a lattice that makes no sense).
Result<BaseHeader> parse_base_header(std::span<const std::byte> payload);

/// REQUIRES: lattice.valid().
void append_base_header(std::vector<std::byte>& payload, const Lattice& lattice, bool lossless);

}  // namespace pmcd::codec
