// SPDX-License-Identifier: MIT
// What holds for the whole mesh: the fixed part at the start of the base packet's payload (the coded base mesh
// follows), and the same bytes in the directory. Layout (little endian):
//   u8 lattice bits  u8 flags: bit 0 lossless, bit 1 float64 coordinates, bit 2 the origin is written as f64,
//   bits 3 and 4: 0 the step is written, 1 to 3 the lattice's upper bound on x, y or z, from which the step follows,
//   bit 5 a lattice of multiples, bit 6 an exact one (only of multiples, of a lossless mesh)
// then without bit 5
//   origin 3 x f32 (f64 with bit 2)  f64 step, or f32 upper bound
// and with it (bits 2 to 4 are 0)
//   u8 multiple and varint zigzag of the exponent of the unit  3 x varint zigzag of the origin in units
// Of all forms that give the same lattice only the shortest is valid, the lowest axis first.
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

/// Errors: truncated, unsupported_feature, corrupt_data (a lattice that makes no sense, or not in its one form; where =
/// byte).
Result<BaseHeader> parse_base_header(std::span<const std::byte> payload);

/// REQUIRES: lattice.valid(); else what it appends will be refused.
void append_base_header(std::vector<std::byte>& payload, const Lattice& lattice, bool lossless);

}  // namespace pmcd::codec
