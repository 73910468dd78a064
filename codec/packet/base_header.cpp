// SPDX-License-Identifier: MIT
#include "codec/packet/base_header.h"

#include <bit>

#include "codec/packet/bytes.h"

namespace pmcd::codec {
namespace {
constexpr std::uint8_t kLosslessFlag = 1;
constexpr std::uint8_t kFloat64Flag = 2;
}  // namespace

Result<BaseHeader> parse_base_header(std::span<const std::byte> payload) {
  BaseHeader header;
  ByteReader reader(payload);
  header.lattice.bits = reader.read<std::uint8_t>();
  const auto flags = reader.read<std::uint8_t>();
  if ((flags & ~(kLosslessFlag | kFloat64Flag)) != 0) {
    return Error{ErrorCode::unsupported_feature, 1, "unknown flags in the base packet"};
  }
  header.lossless = (flags & kLosslessFlag) != 0;
  header.lattice.scalar = (flags & kFloat64Flag) != 0 ? Scalar::float64 : Scalar::float32;
  for (double& value : header.lattice.min) {
    value = header.lattice.scalar == Scalar::float64 ? reader.read_double()
                                                     : std::bit_cast<float>(reader.read<std::uint32_t>());
  }
  header.lattice.step = reader.read_double();
  header.size = reader.position();
  if (!reader.ok()) return Error{ErrorCode::truncated, payload.size(), "the base packet ends within its lattice"};
  if (!header.lattice.valid()) return Error{ErrorCode::corrupt_data, 0, "the base packet's lattice makes no sense"};
  return header;
}

void append_base_header(std::vector<std::byte>& payload, const Lattice& lattice, bool lossless) {
  ByteWriter writer(payload);
  const bool wide = lattice.scalar == Scalar::float64;
  writer.write(static_cast<std::uint8_t>(lattice.bits));
  writer.write(static_cast<std::uint8_t>((lossless ? kLosslessFlag : 0) | (wide ? kFloat64Flag : 0)));
  for (double value : lattice.min) {
    if (wide) {
      writer.write_double(value);
    } else {
      writer.write(std::bit_cast<std::uint32_t>(static_cast<float>(value)));
    }
  }
  writer.write_double(lattice.step);
}

}  // namespace pmcd::codec
