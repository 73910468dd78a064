// SPDX-License-Identifier: MIT
// Fields, varints, errors of levels, checksums and hashes.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/error_value.h"
#include "codec/packet/hash.h"
#include "tests/codec/expect_error.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

std::span<const std::byte> ascii(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

TEST(Bytes, AreLittleEndianAndEndInAnAnswer) {
  Bytes bytes;
  ByteWriter writer(bytes);
  writer.write(std::uint32_t{0x04030201});
  writer.write(std::uint64_t{0x0807060504030201});
  writer.write_double(-0.0);
  ASSERT_EQ(bytes.size(), 20u);
  EXPECT_EQ(bytes[0], std::byte{1});
  EXPECT_EQ(bytes[3], std::byte{4});
  EXPECT_EQ(bytes[19], std::byte{0x80});
  ByteReader reader(bytes);
  EXPECT_EQ(reader.read<std::uint32_t>(), 0x04030201u);
  EXPECT_EQ(reader.read<std::uint64_t>(), 0x0807060504030201u);
  EXPECT_EQ(reader.position(), 12u);
  EXPECT_TRUE(std::signbit(reader.read_double()));
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(reader.read<std::uint8_t>(), 0);
  EXPECT_FALSE(reader.ok());
  ByteReader few(std::span<const std::byte>(bytes).first(3));
  EXPECT_EQ(few.read<std::uint32_t>(), 0u);
  EXPECT_FALSE(few.ok());
  EXPECT_EQ(few.read<std::uint8_t>(), 0) << "a failed reader stays at the end";
}

TEST(Varints, HaveOneForm) {
  const std::vector<std::pair<std::uint64_t, Bytes>> forms = {{0, bytes_of({0})},
                                                              {127, bytes_of({0x7F})},
                                                              {128, bytes_of({0x80, 1})},
                                                              {300, bytes_of({0xAC, 2})},
                                                              {16383, bytes_of({0xFF, 0x7F})},
                                                              {16384, bytes_of({0x80, 0x80, 1})},
                                                              {0xFFFFFFFF, bytes_of({0xFF, 0xFF, 0xFF, 0xFF, 0x0F})},
                                                              {kMostVarint, bytes_of({0xFF, 0xFF, 0xFF, 0xFF, 0x7F})}};
  for (const auto& [value, form] : forms) {
    Bytes bytes;
    ByteWriter(bytes).write_varint(value);
    EXPECT_EQ(bytes, form) << value;
    bytes.push_back(std::byte{0xEE});
    ByteReader reader(bytes);
    EXPECT_EQ(reader.read_varint(), value);
    EXPECT_TRUE(reader.ok());
    EXPECT_EQ(reader.position(), form.size());
    if (value > 0) {
      ByteReader bounded(bytes);
      EXPECT_EQ(bounded.read_varint(value - 1), 0u);
      EXPECT_FALSE(bounded.ok());
      EXPECT_EQ(bounded.malformed_at(), std::size_t{0});
    }
    for (std::size_t length = 0; length < form.size(); ++length) {
      ByteReader few(std::span<const std::byte>(form).first(length));
      EXPECT_EQ(few.read_varint(), 0u);
      EXPECT_FALSE(few.ok());
      EXPECT_FALSE(few.malformed_at().has_value()) << "cut off, not wrong";
    }
  }
  for (const Bytes& form :
       {bytes_of({9, 0x80, 0}), bytes_of({9, 0xFF, 0}), bytes_of({9, 0x81, 0x80, 0}),
        bytes_of({9, 0x80, 0x80, 0x80, 0x80, 0x80, 1}), bytes_of({9, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF})}) {
    ByteReader reader(form);
    EXPECT_EQ(reader.read_varint(), 9u);
    EXPECT_EQ(reader.read_varint(), 0u);
    EXPECT_FALSE(reader.ok());
    EXPECT_EQ(reader.malformed_at(), std::size_t{1});
    EXPECT_EQ(reader.read_varint(), 0u) << "a failed reader stays at the end";
    EXPECT_EQ(reader.malformed_at(), std::size_t{1}) << "the first mistake counts";
  }
}

TEST(Varints, LongerOnesWhereALargerRangeIsGiven) {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 51;
  for (const std::uint64_t value : {std::uint64_t{0}, kMostVarint + 1, kMost - 1, kMost}) {
    Bytes bytes;
    ByteWriter(bytes).write_varint(value);
    ByteReader reader(bytes);
    EXPECT_EQ(reader.read_varint(kMost), value);
    EXPECT_TRUE(reader.ok());
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      ByteReader few(std::span<const std::byte>(bytes).first(length));
      EXPECT_EQ(few.read_varint(kMost), 0u);
      EXPECT_FALSE(few.ok());
      EXPECT_FALSE(few.malformed_at().has_value());
    }
  }
  Bytes beyond;
  ByteWriter(beyond).write_varint(kMost + 1);
  for (const Bytes& form : {beyond, Bytes(9, std::byte{0x80}), Bytes(8, std::byte{0xFF})}) {
    ByteReader reader(form);
    EXPECT_EQ(reader.read_varint(kMost), 0u);
    EXPECT_EQ(reader.malformed_at(), std::size_t{0});
  }
}

TEST(Varints, SignedNumbersBySize) {
  const std::vector<std::pair<std::int64_t, std::uint64_t>> numbers = {
      {0, 0}, {-1, 1}, {1, 2}, {-4, 7}, {64, 128}, {0xFFFFFFFFLL, 0x1FFFFFFFEULL}, {-0x1FFFFFFFELL, 0x3FFFFFFFBULL}};
  for (const auto& [value, code] : numbers) {
    EXPECT_EQ(zigzag(value), code);
    EXPECT_EQ(unzigzag(code), value);
  }
}

TEST(ErrorValues, AreAsCloseAsStated) {
  EXPECT_EQ(error_code_of(0), 0);
  EXPECT_EQ(error_code_of(-0.0), 0);
  EXPECT_EQ(error_code_of(-1), kNotMeasured);
  EXPECT_EQ(error_code_of(std::nan("")), kNotMeasured);
  EXPECT_EQ(error_code_of(1), 50 * 1024);
  EXPECT_EQ(error_code_of(0.75), 49 * 1024 + 512);
  EXPECT_EQ(error_code_of(1e-300), 1);
  EXPECT_EQ(error_code_of(5e-324), 1);
  EXPECT_EQ(error_code_of(1e300), 0xFFFE);
  EXPECT_EQ(error_code_of(HUGE_VAL), 0xFFFE);
  EXPECT_EQ(error_of_code(0xFFFE), 16384 * (1 - 1.0 / 1024));
  EXPECT_EQ(error_of_code(kNotMeasured), -1);
  for (unsigned code = 0; code <= 0xFFFF; ++code) {
    EXPECT_EQ(error_code_of(error_of_code(static_cast<std::uint16_t>(code))), code);
  }
  Random random(8);
  for (int i = 0; i < 10'000; ++i) {
    const double value = std::ldexp(1 + random.below(1u << 30) / 1073741824.0, -static_cast<int>(random.below(50)));
    EXPECT_LE(std::abs(error_of_code(error_code_of(value)) - value), value / 2048);
  }
}

TEST(Crc32c, KnownValues) {
  EXPECT_EQ(crc32c({}), 0u);
  EXPECT_EQ(crc32c(ascii("123456789")), 0xE3069283u);
  EXPECT_EQ(crc32c(Bytes(32, std::byte{0})), 0x8A9136AAu);  // RFC 3720, B.4
  EXPECT_EQ(crc32c(Bytes(32, std::byte{0xFF})), 0x62A8AB43u);
  Bytes ascending(32);
  for (std::size_t i = 0; i < 32; ++i) ascending[i] = static_cast<std::byte>(i);
  EXPECT_EQ(crc32c(ascending), 0x46DD794Eu);
}

TEST(Crc32c, ContinuesAnywhere) {
  Random random(1);
  Bytes bytes(100);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
  const std::uint32_t whole = crc32c(bytes);
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    const std::span<const std::byte> all(bytes);
    EXPECT_EQ(crc32c(all.subspan(cut), crc32c(all.first(cut))), whole) << cut;
  }
}

TEST(Hash, EveryBitAndTheOrderCount) {
  std::set<std::uint64_t> values;
  auto hash_of = [](const std::vector<std::uint64_t>& words) {
    Hash64 hash;
    for (std::uint64_t word : words) hash.add(word);
    return hash.value();
  };
  values.insert(hash_of({}));
  values.insert(hash_of({0}));
  values.insert(hash_of({0, 0}));
  values.insert(hash_of({1, 2}));
  for (unsigned bit = 0; bit < 64; ++bit) {
    values.insert(hash_of({std::uint64_t{1} << bit, 0}));
    values.insert(hash_of({0, std::uint64_t{1} << bit}));
  }
  EXPECT_EQ(values.size(), 4u + 128u);
  EXPECT_EQ(hash_of({1, 2}), hash_of({1, 2}));
  EXPECT_NE(hash_of({1, 2}), hash_of({2, 1}));
}

}  // namespace
}  // namespace pmcd::codec::testing
