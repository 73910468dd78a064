// SPDX-License-Identifier: MIT
#include "codec/packet/base_header.h"

#include <algorithm>
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
constexpr std::uint8_t kKnownFlags = kLosslessFlag | kFloat64Flag | kWideOriginFlag | kUpperAxisMask;

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

}  // namespace

Result<BaseHeader> parse_base_header(std::span<const std::byte> payload) {
  BaseHeader header;
  ByteReader reader(payload);
  header.lattice.bits = reader.read<std::uint8_t>();
  const auto flags = reader.read<std::uint8_t>();
  if ((flags & ~kKnownFlags) != 0) {
    return Error{ErrorCode::unsupported_feature, 1, "unknown flags in the base packet"};
  }
  header.lossless = (flags & kLosslessFlag) != 0;
  header.lattice.scalar = (flags & kFloat64Flag) != 0 ? Scalar::float64 : Scalar::float32;
  for (double& value : header.lattice.min) {
    value = (flags & kWideOriginFlag) != 0 ? reader.read_double() : reader.read_float();
  }
  const unsigned upper_axis = (flags & kUpperAxisMask) >> kUpperAxisShift;
  const double last = upper_axis == 0 ? reader.read_double() : reader.read_float();
  header.size = reader.position();
  if (!reader.ok()) return Error{ErrorCode::truncated, payload.size(), "the base packet ends within its lattice"};
  const Error senseless{ErrorCode::corrupt_data, 0, "the base packet's lattice makes no sense"};
  if (header.lattice.bits < kMinLatticeBits || header.lattice.bits > kMaxLatticeBits) return senseless;
  header.lattice.step =
      upper_axis == 0 ? last : step_to(last, header.lattice.min[upper_axis - 1], header.lattice.max_index());
  if (!header.lattice.valid()) return senseless;
  std::vector<std::byte> shortest;
  append_base_header(shortest, header.lattice, header.lossless);
  if (!std::ranges::equal(shortest, payload.first(header.size))) {
    return Error{ErrorCode::corrupt_data, 1, "the base packet's lattice is not in its shortest form"};
  }
  return header;
}

void append_base_header(std::vector<std::byte>& payload, const Lattice& lattice, bool lossless) {
  ByteWriter writer(payload);
  const bool wide = !std::ranges::all_of(lattice.min, is_float32);
  const Upper upper = upper_bound_of(lattice);
  writer.write(static_cast<std::uint8_t>(lattice.bits));
  writer.write(static_cast<std::uint8_t>((lossless ? kLosslessFlag : 0) |
                                         (lattice.scalar == Scalar::float64 ? kFloat64Flag : 0) |
                                         (wide ? kWideOriginFlag : 0) | (upper.axis << kUpperAxisShift)));
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
