// SPDX-License-Identifier: MIT
#include "codec/packet/base_header.h"

#include <array>
#include <bit>

#include "codec/packet/bytes.h"

namespace pmcd::codec {
namespace {
constexpr std::uint8_t kLosslessFlag = 1;
constexpr std::uint8_t kFloat64Flag = 2;
constexpr std::uint8_t kMultiplesFlag = 4;
constexpr std::uint8_t kExactFlag = 8;
constexpr std::uint8_t kWideOriginFlag = 16;

bool holds_float32(double value) {
  return static_cast<double>(static_cast<float>(value)) == value;
}

std::int64_t read_whole(ByteReader& reader) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 63; shift += 7) {
    const auto group = reader.read<std::uint8_t>();
    value |= std::uint64_t{group & 0x7Fu} << shift;
    if (group < 0x80) break;
  }
  const auto magnitude = static_cast<std::int64_t>(value >> 1);
  return (value & 1) != 0 ? -magnitude : magnitude;
}

void write_whole(ByteWriter& writer, std::int64_t whole) {
  std::uint64_t value =
      whole < 0 ? (static_cast<std::uint64_t>(-whole) << 1) | 1 : static_cast<std::uint64_t>(whole) << 1;
  for (; value >= 0x80; value >>= 7) writer.write(static_cast<std::uint8_t>(0x80 | (value & 0x7F)));
  writer.write(static_cast<std::uint8_t>(value));
}

void read_multiples(ByteReader& reader, Lattice& lattice) {
  Unit unit;
  unit.multiple = reader.read<std::uint8_t>();
  unit.exponent = static_cast<std::int16_t>(reader.read<std::uint16_t>());
  std::array<std::int64_t, 3> origin{};
  for (std::int64_t& k : origin) k = read_whole(reader);
  lattice.unit = unit;
  lattice.origin = origin;
  if (lattice.valid()) lattice.set_unit(unit, origin);
}

}  // namespace

Result<BaseHeader> parse_base_header(std::span<const std::byte> payload) {
  BaseHeader header;
  ByteReader reader(payload);
  header.lattice.bits = reader.read<std::uint8_t>();
  const auto flags = reader.read<std::uint8_t>();
  if ((flags & ~(kLosslessFlag | kFloat64Flag | kMultiplesFlag | kExactFlag | kWideOriginFlag)) != 0) {
    return Error{ErrorCode::unsupported_feature, 1, "unknown flags in the base packet"};
  }
  header.lossless = (flags & kLosslessFlag) != 0;
  header.lattice.scalar = (flags & kFloat64Flag) != 0 ? Scalar::float64 : Scalar::float32;
  header.lattice.exact = (flags & kExactFlag) != 0;
  if ((flags & kMultiplesFlag) != 0) {
    read_multiples(reader, header.lattice);
  } else {
    const bool wide = header.lattice.scalar == Scalar::float64 || (flags & kWideOriginFlag) != 0;
    for (double& value : header.lattice.min) {
      value = wide ? reader.read_double() : std::bit_cast<float>(reader.read<std::uint32_t>());
    }
    header.lattice.step = reader.read_double();
  }
  header.size = reader.position();
  if (!reader.ok()) return Error{ErrorCode::truncated, payload.size(), "the base packet ends within its lattice"};
  if (!header.lattice.valid() || (header.lattice.exact && !header.lossless))
    return Error{ErrorCode::corrupt_data, 0, "the base packet's lattice makes no sense"};
  return header;
}

void append_base_header(std::vector<std::byte>& payload, const Lattice& lattice, bool lossless) {
  ByteWriter writer(payload);
  const bool is_double = lattice.scalar == Scalar::float64;
  const bool all_fit = holds_float32(lattice.min[0]) && holds_float32(lattice.min[1]) && holds_float32(lattice.min[2]);
  const bool wide_origin = !is_double && !lattice.unit && !all_fit;
  const bool wide = is_double || wide_origin;
  writer.write(static_cast<std::uint8_t>(lattice.bits));
  writer.write(static_cast<std::uint8_t>((lossless ? kLosslessFlag : 0) | (is_double ? kFloat64Flag : 0) |
                                         (lattice.unit ? kMultiplesFlag : 0) | (lattice.exact ? kExactFlag : 0) |
                                         (wide_origin ? kWideOriginFlag : 0)));
  if (lattice.unit) {
    writer.write(lattice.unit->multiple);
    writer.write(static_cast<std::uint16_t>(lattice.unit->exponent));
    for (std::int64_t k : lattice.origin) write_whole(writer, k);
    return;
  }
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
