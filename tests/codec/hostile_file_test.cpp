// SPDX-License-Identifier: MIT
// .pmcd files cut, damaged and forged: parse_file answers an error by name or exactly what was written.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "codec/encoder.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/directory.h"
#include "tests/codec/allocations.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

using Bytes = std::vector<std::byte>;

const Bytes& sample_file() {
  static const Bytes file = [] {
    Random random(3);
    TriangleMesh mesh = joined(sphere(3), grid(6, 6, 1));
    add_isolated(mesh, 3, random);
    const Result<Encoded> encoded = encode(mesh, {});
    EXPECT_TRUE(encoded.ok());
    return encoded ? to_file(encoded->packets) : Bytes();
  }();
  return file;
}

std::size_t directory_size() {
  const Result<ParsedDirectory> parsed = parse_directory(sample_file());
  EXPECT_TRUE(parsed.ok());
  return parsed ? parsed->size : 0;
}

Bytes with_right_directory_checksum(Bytes file, std::size_t size) {
  const std::uint32_t sum = crc32c(std::span<const std::byte>(file).first(size - 4));
  for (std::size_t i = 0; i < 4; ++i) file[size - 4 + i] = static_cast<std::byte>((sum >> (8 * i)) & 0xFF);
  return file;
}

TEST(HostileFile, EveryPrefixIsTruncated) {
  const Bytes& file = sample_file();
  ASSERT_TRUE(parse_file(file).ok());
  for (std::size_t length = 0; length < file.size(); ++length) {
    const Bytes cut(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length));
    const Result<ParsedFile> parsed = parse_file(cut);
    ASSERT_FALSE(parsed.ok());
    ASSERT_EQ(parsed.error().code, ErrorCode::truncated) << length << ": " << text(parsed.error());
    ASSERT_EQ(parsed.error().where, length);
  }
}

TEST(HostileFile, OneByteMoreIsTrailing) {
  for (unsigned extra : {0u, 0x50u, 0xFFu}) {
    Bytes longer = sample_file();
    longer.push_back(static_cast<std::byte>(extra));
    const Result<ParsedFile> parsed = parse_file(longer);
    ASSERT_FALSE(parsed.ok());
    EXPECT_EQ(parsed.error().code, ErrorCode::trailing_bytes);
    EXPECT_EQ(parsed.error().where, sample_file().size());
  }
}

TEST(HostileFile, EveryFlippedBitIsRefused) {
  const Bytes& file = sample_file();
  const std::size_t directory = directory_size();
  const std::set<ErrorCode> names = {ErrorCode::bad_magic,           ErrorCode::unsupported_version,
                                     ErrorCode::truncated,           ErrorCode::checksum_mismatch,
                                     ErrorCode::unsupported_feature, ErrorCode::corrupt_data,
                                     ErrorCode::trailing_bytes};
  Random random(2);
  for (std::size_t at = 0; at < file.size(); ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (at >= directory && bit != at % 8) continue;  // the directory whole, one bit of each byte of the packets
      Bytes damaged = file;
      damaged[at] ^= static_cast<std::byte>(1u << bit);
      const Result<ParsedFile> parsed = parse_file(damaged);
      ASSERT_FALSE(parsed.ok()) << at;
      ASSERT_EQ(names.count(parsed.error().code), 1u) << text(parsed.error());
      if (at <= 4) {
        ASSERT_EQ(parsed.error().code, at < 4 ? ErrorCode::bad_magic : ErrorCode::unsupported_version);
      }
    }
  }
}

TEST(HostileFile, ForgedDirectoriesAreRefusedOrSayOnlyWhatNoPacketKnows) {
  const Bytes& file = sample_file();
  const std::size_t size = directory_size();
  const Result<ParsedFile> honest = parse_file(file);
  ASSERT_TRUE(honest.ok());
  std::size_t accepted = 0;
  for (std::size_t bit = 0; bit < 8 * (size - 4); ++bit) {
    Bytes forged = file;
    forged[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
    const Bytes checked = with_right_directory_checksum(forged, size);
    const AllocationMeter meter;
    const Result<ParsedFile> parsed = parse_file(checked);
    ASSERT_LT(meter.peak(), 1u << 20);
    if (!parsed) continue;
    ++accepted;
    ASSERT_EQ(parsed->packets.size(), honest->packets.size());
    ASSERT_EQ(parsed->directory.generation, honest->directory.generation);
    for (std::size_t k = 0; k < parsed->packets.size(); ++k) {
      ASSERT_TRUE(std::equal(parsed->packets[k].begin(), parsed->packets[k].end(), honest->packets[k].begin(),
                             honest->packets[k].end()));
      ASSERT_EQ(parsed->directory.levels[k].vertices, honest->directory.levels[k].vertices);
    }
  }
  EXPECT_GT(accepted, 0u);  // errors of levels, the box
}

TEST(HostileFile, HugeDirectoryIsRefusedBeforeAllocation) {
  // The number of bytes takes two bytes in the sample; others of two and more in their place.
  for (const std::vector<unsigned>& size : std::vector<std::vector<unsigned>>{
           {0xFF, 0x7F}, {0xFF, 0xFF, 0xFF, 0x07}, {0xFF, 0xFF, 0xFF, 0xFF, 0x0F}, {0xFF, 0xFF, 0xFF, 0xFF, 0x7F}}) {
    Bytes forged(sample_file().begin(), sample_file().begin() + 5);
    for (const unsigned byte : size) forged.push_back(static_cast<std::byte>(byte));
    forged.insert(forged.end(), sample_file().begin() + 7, sample_file().end());
    forged.resize(std::min<std::size_t>(forged.size(), 16'000));
    const AllocationMeter meter;
    const Result<ParsedFile> parsed = parse_file(forged);
    ASSERT_FALSE(parsed.ok());
    EXPECT_EQ(parsed.error().code, ErrorCode::truncated) << text(parsed.error());
    EXPECT_LT(meter.peak(), 4096u);
  }
}

TEST(HostileFile, RandomBytesAreNoFile) {
  Random random(7);
  for (int run = 0; run < 3000; ++run) {
    Bytes bytes(random.below(400));
    for (std::byte& b : bytes) b = static_cast<std::byte>(random.below(256));
    if (random.one_in(2)) {
      for (std::size_t i = 0; i < std::min<std::size_t>(5, bytes.size()); ++i) bytes[i] = sample_file()[i];
    }
    ASSERT_FALSE(parse_file(bytes).ok());
  }
}

TEST(HostileFile, PacketsExchangedOrOfAnotherFile) {
  const Result<ParsedFile> honest = parse_file(sample_file());
  ASSERT_TRUE(honest.ok());
  const std::size_t size = directory_size();
  // Two packets change places, bytes only: the directory still has the old order.
  Bytes file(sample_file().begin(), sample_file().begin() + static_cast<std::ptrdiff_t>(size));
  for (std::size_t k : {0u, 2u, 1u}) file.insert(file.end(), honest->packets[k].begin(), honest->packets[k].end());
  for (std::size_t k = 3; k < honest->packets.size(); ++k) {
    file.insert(file.end(), honest->packets[k].begin(), honest->packets[k].end());
  }
  EXPECT_FALSE(parse_file(file).ok());
  // The same with a directory that agrees about the sizes.
  Directory directory = honest->directory;
  std::swap(directory.levels[1], directory.levels[2]);
  Bytes agreeing = serialize(directory);
  agreeing.insert(agreeing.end(), file.begin() + static_cast<std::ptrdiff_t>(size), file.end());
  const Result<ParsedFile> parsed = parse_file(agreeing);
  ASSERT_FALSE(parsed.ok());
  EXPECT_EQ(parsed.error().code, ErrorCode::out_of_order);
}

}  // namespace
}  // namespace pmcd::codec::testing
