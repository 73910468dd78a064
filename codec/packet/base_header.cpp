// SPDX-License-Identifier: MIT
#include "codec/packet/base_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "codec/packet/bytes.h"

namespace pmcd::codec {
namespace {

constexpr std::uint8_t kLosslessFlag = 1;
constexpr std::uint8_t kFloat64Flag = 2;
constexpr std::uint8_t kWideOriginFlag = 4;
constexpr unsigned kUpperAxisShift = 3;
constexpr std::uint8_t kUpperAxisMask = 3 << kUpperAxisShift;
constexpr std::uint8_t kMultiplesFlag = 0x20;
constexpr std::uint8_t kExactFlag = 0x40;
constexpr std::uint8_t kUnknownFlags = 0x80;

constexpr std::uint64_t kMostExponent = zigzag(kMaxPowerOfTwo);
constexpr std::uint64_t kMostOrigin = zigzag(kMaxWhole);

// The step of a lattice whose last point on an axis lies at `upper`; as Lattice::over computes it.
double step_to(double upper, double origin, std::int32_t max_index) {
  return (upper - origin) / max_index;
}

struct Upper {
  unsigned axis = 0;  // 1 to 3; 0: the step follows from no float32
  double value = 0;
};

// The float32 from which the lattice's step follows.
Upper upper_bound_of(const Lattice& lattice) {
  if (!lattice.valid()) return {};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double far = lattice.min[axis] + lattice.step * lattice.max_index();
    if (std::abs(far) > std::numeric_limits<float>::max()) continue;
    const double upper = through_float32(far);
    if (same_bits(step_to(upper, lattice.min[axis], lattice.max_index()), lattice.step)) return {axis + 1, upper};
  }
  return {};
}

void read_multiples(ByteReader& reader, Lattice& lattice) {
  Unit unit;
  unit.multiple = reader.read<std::uint8_t>();
  unit.exponent = static_cast<std::int16_t>(unzigzag(reader.read_varint(kMostExponent)));
  std::array<std::int64_t, 3> origin{};
  for (std::int64_t& k : origin) k = unzigzag(reader.read_varint(kMostOrigin));
  lattice.unit = unit;
  lattice.origin = origin;
  if (valid(unit)) lattice.set_unit(unit, origin);
}

void read_plain(ByteReader& reader, std::uint8_t flags, Lattice& lattice) {
  for (double& value : lattice.min) value = (flags & kWideOriginFlag) != 0 ? reader.read_double() : reader.read_float();
  const unsigned upper_axis = (flags & kUpperAxisMask) >> kUpperAxisShift;
  if (upper_axis == 0) {
    lattice.step = reader.read_double();
  } else {
    lattice.step = step_to(reader.read_float(), lattice.min[upper_axis - 1], lattice.max_index());
  }
}

void append_multiples(ByteWriter& writer, const Unit& unit, const std::array<std::int64_t, 3>& origin) {
  writer.write(unit.multiple);
  writer.write_varint(zigzag(unit.exponent));
  for (const std::int64_t k : origin) writer.write_varint(zigzag(k));
}

}  // namespace

Result<BaseHeader> parse_base_header(std::span<const std::byte> payload) {
  BaseHeader header;
  Lattice& lattice = header.lattice;
  ByteReader reader(payload);
  lattice.bits = reader.read<std::uint8_t>();
  const auto flags = reader.read<std::uint8_t>();
  if ((flags & kUnknownFlags) != 0) {
    return Error{ErrorCode::unsupported_feature, 1, "unknown flags in the base packet"};
  }
  const Error senseless{ErrorCode::corrupt_data, 0, "the base packet's lattice makes no sense"};
  if (reader.ok() && (lattice.bits < kMinLatticeBits || lattice.bits > kMaxLatticeBits)) return senseless;
  header.lossless = (flags & kLosslessFlag) != 0;
  lattice.scalar = (flags & kFloat64Flag) != 0 ? Scalar::float64 : Scalar::float32;
  lattice.exact = (flags & kExactFlag) != 0;
  if ((flags & kMultiplesFlag) != 0) {
    read_multiples(reader, lattice);
  } else {
    read_plain(reader, flags, lattice);
  }
  header.size = reader.position();
  if (reader.malformed_at()) {
    return Error{ErrorCode::corrupt_data, *reader.malformed_at(),
                 "a number in the base packet's lattice is out of range or longer than it needs to be"};
  }
  if (!reader.ok()) return Error{ErrorCode::truncated, payload.size(), "the base packet ends within its lattice"};
  if (!lattice.valid() || (lattice.exact && !header.lossless)) return senseless;
  std::vector<std::byte> shortest;
  append_base_header(shortest, lattice, header.lossless);
  if (!std::equal(shortest.begin(), shortest.end(), payload.begin(),
                  payload.begin() + static_cast<std::ptrdiff_t>(header.size))) {
    return Error{ErrorCode::corrupt_data, 1, "the base packet's lattice is not in its shortest form"};
  }
  return header;
}

void append_base_header(std::vector<std::byte>& payload, const Lattice& lattice, bool lossless) {
  ByteWriter writer(payload);
  const bool wide = !lattice.unit && !std::all_of(lattice.min.begin(), lattice.min.end(), is_float32);
  const Upper upper = lattice.unit ? Upper() : upper_bound_of(lattice);
  writer.write(static_cast<std::uint8_t>(lattice.bits));
  writer.write(static_cast<std::uint8_t>((lossless ? kLosslessFlag : 0) |
                                         (lattice.scalar == Scalar::float64 ? kFloat64Flag : 0) |
                                         (wide ? kWideOriginFlag : 0) | (upper.axis << kUpperAxisShift) |
                                         (lattice.unit ? kMultiplesFlag : 0) | (lattice.exact ? kExactFlag : 0)));
  if (lattice.unit) {
    append_multiples(writer, *lattice.unit, lattice.origin);
    return;
  }
  for (double value : lattice.min) {
    if (wide) {
      writer.write_double(value);
    } else {
      writer.write_float(value);
    }
  }
  if (upper.axis == 0) {
    writer.write_double(lattice.step);
  } else {
    writer.write_float(upper.value);
  }
}

}  // namespace pmcd::codec
