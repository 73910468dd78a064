// SPDX-License-Identifier: MIT
// The base header: each lattice in its shortest form, and no other.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "codec/packet/base_header.h"
#include "codec/packet/bytes.h"
#include "tests/codec/expect_error.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

// What append_base_header makes of it, read back.
Bytes expect_base_header_kept(const Lattice& lattice, bool lossless) {
  Bytes payload(2, std::byte{9});  // it appends
  append_base_header(payload, lattice, lossless);
  const Bytes coded(payload.begin() + 2, payload.end());
  Bytes longer = coded;
  longer.push_back(std::byte{0x77});
  const Result<BaseHeader> header = parse_base_header(longer);
  EXPECT_TRUE(header.ok());
  if (!header) return coded;
  EXPECT_EQ(header->size, coded.size());
  EXPECT_EQ(header->lossless, lossless);
  EXPECT_EQ(header->lattice.scalar, lattice.scalar);
  EXPECT_EQ(header->lattice.bits, lattice.bits);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(header->lattice.min[axis]), std::bit_cast<std::uint64_t>(lattice.min[axis]));
  }
  EXPECT_EQ(std::bit_cast<std::uint64_t>(header->lattice.step), std::bit_cast<std::uint64_t>(lattice.step));
  for (std::size_t length = 0; length < coded.size(); ++length) {
    expect_error(parse_base_header(std::span<const std::byte>(coded).first(length)), ErrorCode::truncated, length);
  }
  return coded;
}

TEST(BaseHeaderTest, EveryFormComesBackWithItsBits) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    const int wide_flag = scalar == Scalar::float64 ? 2 : 0;
    for (bool lossless : {false, true}) {
      Lattice lattice;
      lattice.scalar = scalar;
      lattice.bits = 17;
      lattice.min = {-0.0, 1.5, static_cast<double>(1e-40f)};
      const std::vector<std::pair<double, int>> steps = {
          {0.1, 0}, {100.25 / 131071, 1}, {(3.75 - 1.5) / 131071, 1}, {(1e8 - 1.5) / 131071, 2}, {0, 1}, {1e-300, 0}};
      for (const auto& [step, axis] : steps) {
        lattice.step = step;
        const Bytes coded = expect_base_header_kept(lattice, lossless);
        EXPECT_EQ(coded.size(), axis == 0 ? 22u : 18u) << step;
        EXPECT_EQ(static_cast<int>(coded[1]), (lossless ? 1 : 0) + wide_flag + 8 * axis) << step;
      }
      lattice.min[2] = 0.1;  // no float32
      lattice.step = 0.1;
      EXPECT_EQ(expect_base_header_kept(lattice, lossless).size(), 34u);
      lattice.step = 1.0 / 131071;
      EXPECT_EQ(expect_base_header_kept(lattice, lossless).size(), 30u);
    }
  }
}

TEST(BaseHeaderTest, LatticesOfMeshesTakeEighteenBytes) {
  Random random(12);
  for (int run = 0; run < 300; ++run) {
    TriangleMesh mesh;
    const double size = std::ldexp(1.0, static_cast<int>(random.below(40)) - 20);
    const double away = std::ldexp(1.0, static_cast<int>(random.below(40)) - 20);
    for (int v = 0; v < 9; ++v) {
      Position p{};
      for (double& c : p) c = static_cast<double>(static_cast<float>(away + size * random.below(100'000) / 99'999.0));
      mesh.positions.push_back(p);
    }
    const Result<Lattice> lattice = Lattice::over(mesh, 4 + random.below(21));
    ASSERT_TRUE(lattice.ok());
    EXPECT_EQ(expect_base_header_kept(*lattice, false).size(), 18u);
  }
}

TEST(BaseHeaderTest, StandsWhereTheFormatSays) {
  Lattice lattice;
  lattice.bits = 12;
  lattice.min = {-4, 0.5, 0};
  lattice.step = 8.0 / 4095;
  EXPECT_EQ(expect_base_header_kept(lattice, true),
            bytes_of({12, 0x09, 0, 0, 0x80, 0xC0, 0, 0, 0, 0x3F, 0, 0, 0, 0, 0, 0, 0x80, 0x40}));
}

TEST(BaseHeaderTest, OtherFormsAndSenselessLatticesAreRefused) {
  Lattice lattice;
  lattice.bits = 12;
  lattice.min = {-4, 0.5, 0};
  lattice.step = 8.0 / 4095;
  Bytes good;
  append_base_header(good, lattice, true);
  auto with = [&](std::size_t at, int value) {
    Bytes bytes = good;
    bytes[at] = static_cast<std::byte>(value);
    return parse_base_header(bytes);
  };
  expect_error(with(1, 9 | 0x80), ErrorCode::unsupported_feature, 1);
  expect_error(with(1, 9 | 0x40), ErrorCode::corrupt_data, 0);  // exact without a unit
  for (const int bits : {0, 3, 25, 99, 255}) expect_error(with(0, bits), ErrorCode::corrupt_data, 0);
  EXPECT_TRUE(with(17, 0xC0).ok());                          // -4, the origin itself: step 0
  expect_error(with(17, 0xC1), ErrorCode::corrupt_data, 0);  // -16, below the origin
  // the same step by an axis behind the first that says it
  Bytes by_z = good;
  by_z[1] = std::byte{0x19};
  by_z[16] = std::byte{0};
  by_z[17] = std::byte{0x41};  // 8
  expect_error(parse_base_header(by_z), ErrorCode::corrupt_data, 1);
  // the step itself although a bound says it
  Bytes by_step(good.begin(), good.begin() + 14);
  by_step[1] = std::byte{1};
  ByteWriter(by_step).write_double(lattice.step);
  expect_error(parse_base_header(by_step), ErrorCode::corrupt_data, 1);
  // an origin in f64 that needs none
  Bytes wide = bytes_of({12, 0x0D});
  ByteWriter writer(wide);
  for (const double value : lattice.min) writer.write_double(value);
  writer.write_float(4);
  expect_error(parse_base_header(wide), ErrorCode::corrupt_data, 1);
  for (const float bound : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    Bytes endless(good.begin(), good.begin() + 14);
    ByteWriter(endless).write(std::bit_cast<std::uint32_t>(bound));
    expect_error(parse_base_header(endless), ErrorCode::corrupt_data, 0);
  }
}

TEST(BaseHeaderTest, LatticesOfMultiplesComeBack) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    for (const Unit& unit : {Unit{1, 0}, Unit{2, 22}, Unit{5, -22}, Unit{1, -7}, Unit{0, -40}, Unit{0, 50}}) {
      for (const bool exact : {false, true}) {
        Lattice lattice;
        lattice.scalar = scalar;
        lattice.bits = 24;
        lattice.exact = exact;
        lattice.set_unit(unit, {-7, 300, 0});
        const Bytes coded = expect_base_header_kept(lattice, true);
        EXPECT_EQ(coded.size(), 8u);
        EXPECT_EQ(static_cast<int>(coded[1]), 0x21 + (scalar == Scalar::float64 ? 2 : 0) + (exact ? 0x40 : 0));
        const Result<BaseHeader> header = parse_base_header(coded);
        ASSERT_TRUE(header.ok());
        EXPECT_EQ(header->lattice.unit, lattice.unit);
        EXPECT_EQ(header->lattice.origin, lattice.origin);
        EXPECT_EQ(header->lattice.exact, exact);
      }
    }
  }
  Lattice far;
  far.scalar = Scalar::float64;
  far.bits = 4;
  far.set_unit({0, -1000}, {-kMaxWhole, kMaxWhole - (1 << kMaxLatticeBits), 1});
  EXPECT_EQ(expect_base_header_kept(far, false).size(), 3u + 2u + 8u + 8u + 1u);
}

TEST(BaseHeaderTest, AbsurdMultiplesAreRefused) {
  Lattice lattice;
  lattice.bits = 20;
  lattice.exact = true;
  lattice.set_unit({5, -7}, {-3, std::int64_t{1} << 40, 0});
  const Bytes good = expect_base_header_kept(lattice, true);
  EXPECT_EQ(good.size(), 3u + 1u + 1u + 6u + 1u);
  auto with = [&](std::size_t at, std::initializer_list<int> values) {
    Bytes bytes = good;
    for (const int value : values) bytes[at++] = static_cast<std::byte>(value);
    return parse_base_header(bytes);
  };
  expect_error(with(1, {0x60}), ErrorCode::corrupt_data, 0);  // exact, but not lossless
  for (const int other : {4, 8, 16, 24}) expect_error(with(1, {0x61 | other}), ErrorCode::corrupt_data, 1);
  expect_error(with(2, {3}), ErrorCode::corrupt_data, 0);           // three times a power of ten
  expect_error(with(3, {0x7F}), ErrorCode::corrupt_data, 0);        // 10^-64
  expect_error(with(3, {0xD1, 0x0F}), ErrorCode::corrupt_data, 3);  // 10^-1001
  expect_error(with(3, {0x80, 0}), ErrorCode::corrupt_data, 3);     // a longer zero
  expect_error(with(3, {0xD0, 0x0F, 1, 1}), ErrorCode::corrupt_data, 0);
  EXPECT_TRUE(with(3, {0x0E}).ok());
  Bytes longest = bytes_of({20, 0x61, 1, 0, 0, 0});
  ByteWriter(longest).write_varint(zigzag(kMaxWhole));
  expect_error(parse_base_header(longest), ErrorCode::corrupt_data, 0);  // the last index would go beyond
  Bytes too_long = bytes_of({20, 0x61, 1, 0, 0, 0});
  ByteWriter(too_long).write_varint(zigzag(kMaxWhole) + 1);
  expect_error(parse_base_header(too_long), ErrorCode::corrupt_data, 6);
  // Coordinates that are not finite.
  Bytes endless = bytes_of({20, 0x23, 0, 0xD0, 0x0F, 0, 0});
  ByteWriter(endless).write_varint(zigzag(kMaxWhole / 2));
  expect_error(parse_base_header(endless), ErrorCode::corrupt_data, 0);
}

TEST(BaseHeaderTest, OriginsBeyondFloat32AreRefused) {
  Lattice lattice;
  lattice.min = {-1e300, 0, 0};
  lattice.step = 1e300 / 4095;
  Bytes bytes;
  append_base_header(bytes, lattice, false);
  expect_error(parse_base_header(bytes), ErrorCode::corrupt_data, 0);
}

}  // namespace
}  // namespace pmcd::codec::testing
