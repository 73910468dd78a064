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
  for (const int flag : {0x20, 0x40, 0x80}) expect_error(with(1, 9 | flag), ErrorCode::unsupported_feature, 1);
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

}  // namespace
}  // namespace pmcd::codec::testing
