// SPDX-License-Identifier: MIT
// Packet headers: written as the format says, read back, refused by name.
#include <gtest/gtest.h>

#include <algorithm>

#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/header.h"
#include "tests/codec/expect_error.h"

namespace pmcd::codec::testing {
namespace {

PacketHeader sample_header(std::uint32_t level = 7, bool last = true) {
  PacketHeader header;
  header.last = last;
  header.level = level;
  header.vertices = 0x01020304;
  header.faces = 0x0A0B0C0D;
  header.mesh_hash = 0x1122334455667788;
  header.generation = 0x99AABBCCDDEEFF00;
  return header;
}

Bytes sample_packet(std::uint32_t level = 7, bool last = true) {
  return make_packet(sample_header(level, last), Bytes(5, std::byte{0x5A}));
}

TEST(PacketHeaderTest, ComesBackAsWritten) {
  const Bytes packet = sample_packet();
  const Result<PacketHeader> header = check_packet(packet);
  ASSERT_TRUE(header.ok()) << text(header.error());
  EXPECT_TRUE(header->last);
  EXPECT_EQ(header->level, 7u);
  EXPECT_EQ(header->payload_bytes, 5u);
  EXPECT_EQ(header->vertices, 0x01020304u);
  EXPECT_EQ(header->faces, 0x0A0B0C0Du);
  EXPECT_EQ(header->mesh_hash, 0x1122334455667788u);
  EXPECT_EQ(header->generation, 0xFF00u);
  EXPECT_EQ(header->size + 5, packet.size());
  EXPECT_EQ(make_packet(*header, Bytes(5, std::byte{0x5A})), packet);
}

TEST(PacketHeaderTest, HashAndGenerationAreWholeWhereTheyAreTheLastWord) {
  constexpr std::uint64_t kHash = 0x1122334455667788;
  constexpr std::uint64_t kGeneration = 0x99AABBCCDDEEFF00;
  for (const bool base : {false, true}) {
    for (const bool last : {false, true}) {
      const Result<PacketHeader> header = check_packet(sample_packet(base ? 0 : 7, last));
      ASSERT_TRUE(header.ok());
      EXPECT_EQ(header->is_base(), base);
      EXPECT_EQ(header->last, last);
      EXPECT_EQ(header->mesh_hash, last ? kHash : kHash & 0xFFFFFF);
      EXPECT_EQ(header->generation, base ? kGeneration : kGeneration & 0xFFFF);
      EXPECT_TRUE(header->proves(kHash));
      EXPECT_TRUE(header->is_of(kGeneration));
      for (unsigned bit = 0; bit < 64; ++bit) {
        EXPECT_EQ(header->proves(kHash ^ (std::uint64_t{1} << bit)), !last && bit >= 24) << bit;
        EXPECT_EQ(header->is_of(kGeneration ^ (std::uint64_t{1} << bit)), !base && bit >= 16) << bit;
      }
      EXPECT_EQ(header->size, 6u + 1 + 1 + 4 + 5 + (last ? 8 : 3) + (base ? 8 : 2));
    }
  }
}

TEST(PacketHeaderTest, SizesAreWithinTheirBounds) {
  EXPECT_EQ(make_packet(PacketHeader{.level = 1}, {}).size(), kLeastHeaderBytes);
  PacketHeader header;
  for (const bool last : {false, true}) {
    for (const std::uint32_t level : {0u, 1u, 127u, 128u, 0xFFFFFFFFu}) {
      for (const std::uint32_t vertices : {0u, 63u, 5000u, 0xFFFFFFFFu}) {
        for (const std::uint32_t faces : {0u, 9996u, 0xFFFFFFFFu}) {
          header.last = last;
          header.level = level;
          header.vertices = vertices;
          header.faces = faces;
          const Bytes packet = make_packet(header, {});
          EXPECT_GE(packet.size(), kLeastHeaderBytes);
          EXPECT_LE(packet.size(), kMostHeaderBytes);
          const Result<PacketHeader> got = check_packet(packet);
          ASSERT_TRUE(got.ok()) << text(got.error());
          EXPECT_EQ(got->level, level);
          EXPECT_EQ(got->vertices, vertices);
          EXPECT_EQ(got->faces, faces);
        }
      }
    }
  }
}

TEST(PacketHeaderTest, StandsWhereTheFormatSays) {
  const Bytes packet = sample_packet();
  const Bytes magic_and_flags = bytes_of({0x9B, (kFormatVersion << 4) | 1});
  const Bytes numbers = bytes_of({7,                                               // level
                                  5,                                               // payload bytes
                                  0x84, 0x86, 0x88, 0x08,                          // vertices
                                  0x8A, 0x98, 0xB8, 0x80, 0x01,                    // zigzag of faces - 2 * vertices
                                  0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11,  // hash
                                  0x00, 0xFF,                                      // 16 bits of the generation
                                  0x5A, 0x5A, 0x5A, 0x5A, 0x5A});
  ASSERT_EQ(packet.size(), 6 + numbers.size());
  EXPECT_TRUE(std::equal(magic_and_flags.begin(), magic_and_flags.end(), packet.begin()));
  EXPECT_TRUE(std::equal(numbers.begin(), numbers.end(), packet.begin() + 6));
  ByteReader checksum(std::span<const std::byte>(packet).subspan(2));
  EXPECT_EQ(checksum.read<std::uint32_t>(), crc32c(numbers, crc32c(magic_and_flags)));
  EXPECT_EQ(with_right_checksum(packet), packet) << "the checksum is that of all other bytes";
}

TEST(PacketHeaderTest, EveryFieldIsRefusedByName) {
  const Bytes good = sample_packet();
  const std::size_t header_bytes = good.size() - 5;
  auto with = [&](std::size_t at, int value) {
    Bytes packet = good;
    packet[at] = static_cast<std::byte>(value);
    return with_right_checksum(std::move(packet));
  };
  expect_error(check_packet(with(0, 'P')), ErrorCode::bad_magic, 0);
  for (int version = 0; version < 16; ++version) {
    if (version == kFormatVersion) continue;
    expect_error(check_packet(with(1, (version << 4) | 1)), ErrorCode::unsupported_version,
                 static_cast<std::uint64_t>(version));
  }
  for (const int missing : {1, 4, 7}) {  // of the last packet
    expect_error(check_packet(with(1, (kFormatVersion << 4) | 1 | (missing << 1))), ErrorCode::corrupt_data, 1);
  }
  expect_error(check_packet(with(7, 6)), ErrorCode::truncated, good.size());
  expect_error(check_packet(with(7, 4)), ErrorCode::trailing_bytes, header_bytes + 4);
  for (std::size_t i = 0; i < good.size(); ++i) {
    if (i >= 6 && i < header_bytes) continue;
    if (i < 2) continue;
    Bytes damaged = good;
    damaged[i] ^= std::byte{0x10};
    expect_error(check_packet(damaged), ErrorCode::checksum_mismatch, 2);
  }
}

TEST(PacketHeaderTest, NumbersHaveOneFormAndTheirRange) {
  const Bytes head = bytes_of({0x9B, kFormatVersion << 4, 0, 0, 0, 0});
  const Bytes tail = bytes_of({1, 2, 3, 4, 5});  // hash and generation
  auto parsed = [&](std::initializer_list<int> numbers) {
    Bytes packet = head;
    const Bytes middle = bytes_of(numbers);
    packet.insert(packet.end(), middle.begin(), middle.end());
    packet.insert(packet.end(), tail.begin(), tail.end());
    return parse_packet_header(packet);
  };
  const Result<PacketHeader> plain = parsed({1, 0, 10, 7});
  ASSERT_TRUE(plain.ok()) << text(plain.error());
  EXPECT_EQ(plain->faces, 16u);
  EXPECT_EQ(plain->mesh_hash, 0x030201u);
  EXPECT_EQ(plain->generation, 0x0504u);
  expect_error(parsed({0x81, 0, 0, 10, 7}), ErrorCode::corrupt_data, 6);
  expect_error(parsed({1, 0x80, 0, 10, 7}), ErrorCode::corrupt_data, 7);
  expect_error(parsed({1, 0, 0x8A, 0, 7}), ErrorCode::corrupt_data, 8);
  expect_error(parsed({1, 0, 10, 0x87, 0}), ErrorCode::corrupt_data, 9);
  expect_error(parsed({0x80, 0x80, 0x80, 0x80, 0x10, 0, 10, 7}), ErrorCode::corrupt_data, 6);  // 2^32
  expect_error(parsed({1, 0xFF, 0xFF, 0xFF, 0xFF, 0x0F, 10, 7}), ErrorCode::corrupt_data, 7);  // no room for a header
  expect_error(parsed({1, 0, 0x80, 0x80, 0x80, 0x80, 0x10, 7}), ErrorCode::corrupt_data, 8);   // 2^32 vertices
  expect_error(parsed({1, 0, 10, 41}), ErrorCode::corrupt_data, 9);                            // -1 faces
  EXPECT_TRUE(parsed({1, 0, 10, 39}).ok());                                                    // none
  expect_error(parsed({1, 0, 0, 0x80, 0x80, 0x80, 0x80, 0x20}), ErrorCode::corrupt_data, 9);   // 2^32 faces
  EXPECT_TRUE(parsed({1, 0, 0, 0xFE, 0xFF, 0xFF, 0xFF, 0x1F}).ok());
}

TEST(PacketHeaderTest, MissingDigitsHaveOneForm) {
  PacketHeader header;
  for (unsigned missing = 0; missing < 24; ++missing) {
    header.missing_digits = static_cast<std::uint8_t>(missing);
    const Bytes packet = make_packet(header, {});
    EXPECT_EQ(packet.size(), 21u + (missing < 7 ? 0 : 1));
    EXPECT_EQ(packet[1], static_cast<std::byte>((kFormatVersion << 4) | (std::min(missing, 7u) << 1)));
    const Result<PacketHeader> got = check_packet(packet);
    ASSERT_TRUE(got.ok()) << text(got.error());
    EXPECT_EQ(got->missing_digits, missing);
    EXPECT_EQ(got->size, packet.size());
    if (missing < 7) continue;
    EXPECT_EQ(packet[10], static_cast<std::byte>(missing)) << "behind level, payload bytes and counts";
    expect_error(parse_packet_header(std::span<const std::byte>(packet).first(10)), ErrorCode::truncated, 10);
    for (const int wrong : {0, 6, 24, 255}) {
      Bytes forged = packet;
      forged[10] = static_cast<std::byte>(wrong);
      expect_error(check_packet(with_right_checksum(forged)), ErrorCode::corrupt_data, 10);
    }
  }
}

TEST(PacketHeaderTest, HeaderAloneSaysWhatFollows) {
  for (const std::uint32_t level : {0u, 7u}) {
    for (const bool last : {false, true}) {
      const Bytes packet = sample_packet(level, last);
      const std::size_t header_bytes = packet.size() - 5;
      const std::span<const std::byte> all(packet);
      const Result<PacketHeader> header = parse_packet_header(all.first(header_bytes));
      ASSERT_TRUE(header.ok());
      EXPECT_EQ(header->payload_bytes, 5u);
      EXPECT_EQ(header->size, header_bytes);
      for (std::size_t length = 0; length < header_bytes; ++length) {
        expect_error(parse_packet_header(all.first(length)), ErrorCode::truncated, length);
      }
    }
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
