// SPDX-License-Identifier: MIT
// Fields, checksums, packet headers, the directory and the file: written as the format says, read back, refused by
// name.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string_view>

#include "codec/packet/base_header.h"
#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/directory.h"
#include "codec/packet/hash.h"
#include "codec/packet/header.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

using Bytes = std::vector<std::byte>;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

Bytes sample_packet(PacketKind kind = PacketKind::refinement, std::size_t payload = 5) {
  PacketHeader header;
  header.kind = kind;
  header.last = true;
  header.level = kind == PacketKind::base ? 0 : 7;
  header.vertices = 0x01020304;
  header.faces = 0x0A0B0C0D;
  header.mesh_hash = 0x1122334455667788;
  header.generation = 0x99AABBCCDDEEFF00;
  Bytes packet(kPacketHeaderBytes + payload, std::byte{0x5A});
  write_packet_header(packet, header);
  return packet;
}

template <typename T>
void expect_error(const Result<T>& result, ErrorCode code, std::uint64_t where) {
  ASSERT_FALSE(result.ok());
  EXPECT_STREQ(error_name(result.error().code), error_name(code)) << result.error().detail;
  EXPECT_EQ(result.error().where, where) << result.error().detail;
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

TEST(Crc32c, KnownValues) {
  EXPECT_EQ(crc32c({}), 0u);
  EXPECT_EQ(crc32c(bytes_of("123456789")), 0xE3069283u);
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

TEST(PacketHeaderTest, ComesBackAsWritten) {
  const Bytes packet = sample_packet();
  const Result<PacketHeader> header = check_packet(packet);
  ASSERT_TRUE(header.ok()) << text(header.error());
  EXPECT_EQ(header->kind, PacketKind::refinement);
  EXPECT_TRUE(header->last);
  EXPECT_EQ(header->level, 7u);
  EXPECT_EQ(header->payload_bytes, 5u);
  EXPECT_EQ(header->vertices, 0x01020304u);
  EXPECT_EQ(header->faces, 0x0A0B0C0Du);
  EXPECT_EQ(header->mesh_hash, 0x1122334455667788u);
  EXPECT_EQ(header->generation, 0x99AABBCCDDEEFF00u);
}

TEST(PacketHeaderTest, StandsWhereTheFormatSays) {
  const Bytes packet = sample_packet();
  const Bytes expected = {std::byte{'P'},  std::byte{'M'},  std::byte{'C'},  std::byte{'P'},  std::byte{kFormatVersion},
                          std::byte{1},    std::byte{1},    std::byte{0},    std::byte{7},    std::byte{0},
                          std::byte{0},    std::byte{0},    std::byte{5},    std::byte{0},    std::byte{0},
                          std::byte{0},    std::byte{4},    std::byte{3},    std::byte{2},    std::byte{1},
                          std::byte{0x0D}, std::byte{0x0C}, std::byte{0x0B}, std::byte{0x0A}, std::byte{0x88},
                          std::byte{0x77}, std::byte{0x66}, std::byte{0x55}, std::byte{0x44}, std::byte{0x33},
                          std::byte{0x22}, std::byte{0x11}, std::byte{0x00}, std::byte{0xFF}, std::byte{0xEE},
                          std::byte{0xDD}, std::byte{0xCC}, std::byte{0xBB}, std::byte{0xAA}, std::byte{0x99},
                          std::byte{0},    std::byte{0},    std::byte{0},    std::byte{0}};
  ASSERT_EQ(expected.size(), kPacketHeaderBytes - 4);
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), packet.begin()));
  EXPECT_EQ(with_right_checksum(packet), packet) << "the checksum is that of all other bytes";
}

TEST(PacketHeaderTest, EveryFieldIsRefusedByName) {
  const Bytes good = sample_packet();
  auto with = [&](std::size_t at, int value) {
    Bytes packet = good;
    packet[at] = static_cast<std::byte>(value);
    return with_right_checksum(std::move(packet));
  };
  for (std::size_t i = 0; i < 4; ++i) expect_error(check_packet(with(i, 'x')), ErrorCode::bad_magic, i);
  expect_error(check_packet(with(4, kFormatVersion + 1)), ErrorCode::unsupported_version, kFormatVersion + 1);
  expect_error(check_packet(with(5, 2)), ErrorCode::unsupported_feature, 5);
  expect_error(check_packet(with(6, 2)), ErrorCode::unsupported_feature, 6);
  expect_error(check_packet(with(7, 1)), ErrorCode::unsupported_feature, 7);
  expect_error(check_packet(with(5, 0)), ErrorCode::corrupt_data, 8);  // a base packet of level 7
  expect_error(check_packet(with(8, 0)), ErrorCode::corrupt_data, 8);  // a refinement of level 0
  expect_error(check_packet(with(12, 6)), ErrorCode::truncated, good.size());
  expect_error(check_packet(with(12, 4)), ErrorCode::trailing_bytes, kPacketHeaderBytes + 4);
  expect_error(check_packet(with(15, 0xFF)), ErrorCode::truncated, good.size());
  expect_error(check_packet(with(42, 1)), ErrorCode::unsupported_feature, 40);
  for (std::size_t i = kPacketHeaderBytes - 4; i < good.size(); ++i) {
    Bytes damaged = good;
    damaged[i] ^= std::byte{0x10};
    expect_error(check_packet(damaged), ErrorCode::checksum_mismatch, kPacketHeaderBytes - 4);
  }
}

TEST(PacketHeaderTest, HeaderAloneSaysWhatFollows) {
  const Bytes packet = sample_packet();
  const Result<PacketHeader> header = parse_packet_header(std::span<const std::byte>(packet).first(kPacketHeaderBytes));
  ASSERT_TRUE(header.ok());
  EXPECT_EQ(header->payload_bytes, 5u);
  for (std::size_t length = 0; length < kPacketHeaderBytes; ++length) {
    expect_error(parse_packet_header(std::span<const std::byte>(packet).first(length)), ErrorCode::truncated, length);
  }
}

TEST(BaseHeaderTest, BothScalarsComeBackWithTheirBits) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    for (bool lossless : {false, true}) {
      Lattice lattice;
      lattice.scalar = scalar;
      lattice.bits = 17;
      lattice.min = {-0.0, 1.5, static_cast<double>(1e-40f)};
      lattice.step = 0.1;
      Bytes payload(2, std::byte{9});  // it appends
      append_base_header(payload, lattice, lossless);
      const std::span<const std::byte> coded = std::span<const std::byte>(payload).subspan(2);
      const Result<BaseHeader> header = parse_base_header(coded);
      ASSERT_TRUE(header.ok());
      EXPECT_EQ(header->size, coded.size());
      EXPECT_EQ(header->size, scalar == Scalar::float32 ? 22u : 34u);
      EXPECT_EQ(header->lossless, lossless);
      EXPECT_EQ(header->lattice.scalar, scalar);
      EXPECT_EQ(header->lattice.bits, 17u);
      EXPECT_EQ(header->lattice.min, lattice.min);
      EXPECT_TRUE(std::signbit(header->lattice.min[0]));
      EXPECT_EQ(header->lattice.step, 0.1);
      for (std::size_t length = 0; length < coded.size(); ++length) {
        ASSERT_FALSE(parse_base_header(coded.first(length)).ok()) << length;
      }
      Bytes flags = payload;
      flags[3] |= std::byte{32};
      expect_error(parse_base_header(std::span<const std::byte>(flags).subspan(2)), ErrorCode::unsupported_feature, 1);
      Bytes bits = payload;
      bits[2] = std::byte{25};
      expect_error(parse_base_header(std::span<const std::byte>(bits).subspan(2)), ErrorCode::corrupt_data, 0);
    }
  }
}

TEST(BaseHeaderTest, OriginsThatNoFloatHoldsAreWide) {
  Lattice lattice;
  lattice.min = {0.1, 1, 2};
  lattice.step = 0.1;
  Bytes payload;
  append_base_header(payload, lattice, true);
  EXPECT_EQ(payload.size(), 34u);
  const Result<BaseHeader> header = parse_base_header(payload);
  ASSERT_TRUE(header.ok());
  EXPECT_EQ(header->lattice.scalar, Scalar::float32);
  EXPECT_EQ(header->lattice.min, lattice.min);
}

TEST(BaseHeaderTest, LatticesOfMultiplesComeBack) {
  Lattice lattice;
  lattice.bits = 20;
  lattice.exact = true;
  lattice.set_unit({5, -7}, {-3, std::int64_t{1} << 40, 0});
  Bytes payload;
  append_base_header(payload, lattice, true);
  EXPECT_EQ(payload.size(), 2u + 3u + 1u + 6u + 1u);
  const Result<BaseHeader> header = parse_base_header(payload);
  ASSERT_TRUE(header.ok());
  EXPECT_EQ(header->size, payload.size());
  EXPECT_TRUE(header->lattice.exact);
  EXPECT_EQ(header->lattice.unit, lattice.unit);
  EXPECT_EQ(header->lattice.origin, lattice.origin);
  EXPECT_EQ(header->lattice.min, (Position{-1.5e-6, 549755.813888, 0}));
  EXPECT_EQ(header->lattice.step, 5e-7);
  for (std::size_t length = 0; length < payload.size(); ++length) {
    ASSERT_FALSE(parse_base_header(std::span<const std::byte>(payload).first(length)).ok()) << length;
  }
  auto refused = [&](std::size_t at, std::uint8_t value) {
    Bytes changed = payload;
    changed[at] = std::byte{value};
    expect_error(parse_base_header(changed), ErrorCode::corrupt_data, 0);
  };
  refused(1, 4 | 8);  // exact, but not lossless
  refused(2, 3);      // three times a power of ten
  refused(3, 0x80);   // 10^-128
  refused(4, 0x7F);   // 10^32505
  Lattice far = lattice;
  far.origin[1] = std::int64_t{1} << 50;
  Bytes beyond;
  append_base_header(beyond, far, true);
  expect_error(parse_base_header(beyond), ErrorCode::corrupt_data, 0);
  Bytes plain;
  append_base_header(plain, Lattice(), true);
  plain[1] |= std::byte{8};  // exact without a unit
  expect_error(parse_base_header(plain), ErrorCode::corrupt_data, 0);
}

std::vector<EncodedPacket> sample_packets(std::optional<unsigned> bits = 10) {
  EncodeOptions options;
  options.bits = bits;
  Result<Encoded> encoded = encode(torus(12, 8), options);
  EXPECT_TRUE(encoded.ok());
  return encoded ? std::move(encoded).value().packets : std::vector<EncodedPacket>();
}

TEST(DirectoryTest, TellsWhatThePacketsAre) {
  for (const bool lossless : {false, true}) {
    const std::vector<EncodedPacket> packets = sample_packets(lossless ? std::nullopt : std::optional<unsigned>(10));
    const Result<Directory> directory = make_directory(spans(packets));
    ASSERT_TRUE(directory.ok()) << text(directory.error());
    EXPECT_EQ(directory->format_version, kFormatVersion);
    EXPECT_EQ(directory->lossless, lossless);
    ASSERT_EQ(directory->levels.size(), packets.size());
    for (std::size_t k = 0; k < packets.size(); ++k) {
      EXPECT_EQ(directory->levels[k].bytes, packets[k].bytes.size());
      EXPECT_EQ(directory->levels[k].vertices, packets[k].vertices);
      EXPECT_EQ(directory->levels[k].faces, packets[k].faces);
      EXPECT_EQ(directory->levels[k].crc32c, check_packet(packets[k].bytes)->crc32c);
      EXPECT_EQ(directory->levels[k].error_rms, -1);
    }
    EXPECT_EQ(directory->generation, check_packet(packets[0].bytes)->generation);
    EXPECT_EQ(directory->levels.back().vertices, 96u);
    EXPECT_EQ(directory->lattice.min, (Position{-4, -4, -1}));
    EXPECT_EQ(directory->box_min, directory->lattice.min);
  }
}

TEST(DirectoryTest, ComesBackAsWritten) {
  const std::vector<EncodedPacket> packets = sample_packets();
  Result<Directory> directory = make_directory(spans(packets));
  ASSERT_TRUE(directory.ok());
  directory->box_min = {-1, -2, -3.5};
  directory->box_max = {1e10, 2, 3.25};
  for (std::size_t k = 0; k < directory->levels.size(); ++k) {
    directory->levels[k].error_rms = 0.125 / (1 + static_cast<double>(k));
    directory->levels[k].error_max = k == 0 ? -1 : 0.5;
  }
  Bytes bytes = serialize(*directory);
  EXPECT_EQ(bytes.size(), 104 + 32 * directory->levels.size());
  bytes.insert(bytes.end(), 17, std::byte{0xEE});  // what follows is not its business
  const Result<ParsedDirectory> parsed = parse_directory(bytes);
  ASSERT_TRUE(parsed.ok()) << text(parsed.error());
  EXPECT_EQ(parsed->size, bytes.size() - 17);
  const Directory& got = parsed->directory;
  EXPECT_EQ(got.format_version, directory->format_version);
  EXPECT_EQ(got.lossless, directory->lossless);
  EXPECT_EQ(got.generation, directory->generation);
  EXPECT_EQ(got.lattice.bits, 10u);
  EXPECT_EQ(got.lattice.min, directory->lattice.min);
  EXPECT_EQ(got.lattice.step, directory->lattice.step);
  EXPECT_EQ(got.box_min, directory->box_min);
  EXPECT_EQ(got.box_max, directory->box_max);
  ASSERT_EQ(got.levels.size(), directory->levels.size());
  for (std::size_t k = 0; k < got.levels.size(); ++k) {
    EXPECT_EQ(got.levels[k].bytes, directory->levels[k].bytes);
    EXPECT_EQ(got.levels[k].crc32c, directory->levels[k].crc32c);
    EXPECT_EQ(got.levels[k].error_rms, directory->levels[k].error_rms);
    EXPECT_EQ(got.levels[k].error_max, directory->levels[k].error_max);
  }
  EXPECT_EQ(serialize(got), Bytes(bytes.begin(), bytes.end() - 17));
}

TEST(DirectoryTest, NoneForPacketsThatDoNotBelongTogether) {
  const std::vector<EncodedPacket> packets = sample_packets();
  const std::vector<EncodedPacket> other = sample_packets(11);
  ASSERT_GE(packets.size(), 3u);
  expect_error(make_directory({}), ErrorCode::truncated, 0);
  auto swapped = spans(packets);
  std::swap(swapped[1], swapped[2]);
  expect_error(make_directory(swapped), ErrorCode::out_of_order, 2);
  auto mixed = spans(packets);
  mixed[1] = other[1].bytes;
  expect_error(make_directory(mixed), ErrorCode::wrong_mesh, 1);
  auto without_last = spans(packets);
  without_last.pop_back();
  expect_error(make_directory(without_last), ErrorCode::corrupt_data, packets.size() - 2);
  auto without_base = spans(packets);
  without_base.erase(without_base.begin());
  expect_error(make_directory(without_base), ErrorCode::out_of_order, 1);
  auto twice = spans(packets);
  twice.push_back(twice.back());
  EXPECT_FALSE(make_directory(twice).ok());
}

TEST(DirectoryTest, ContentThatMakesNoSenseIsRefusedBehindARightChecksum) {
  const Result<Directory> good = make_directory(spans(sample_packets()));
  ASSERT_TRUE(good.ok());
  auto parsed = [&](auto change) {
    Directory directory = *good;
    change(directory);
    return parse_directory(serialize(directory));
  };
  const double nan = std::nan("");
  EXPECT_TRUE(parsed([](Directory&) {}).ok());
  expect_error(parsed([](Directory& d) { d.format_version = 200; }), ErrorCode::unsupported_version, 200);
  expect_error(parsed([](Directory& d) { d.lattice.bits = 99; }), ErrorCode::corrupt_data, 6);
  expect_error(parsed([&](Directory& d) { d.lattice.step = nan; }), ErrorCode::corrupt_data, 6);
  expect_error(parsed([&](Directory& d) { d.box_max[1] = nan; }), ErrorCode::corrupt_data, 52);
  expect_error(parsed([](Directory& d) { d.levels.clear(); }), ErrorCode::corrupt_data, 8);
  expect_error(parsed([](Directory& d) { d.levels[1].bytes = 47; }), ErrorCode::corrupt_data, 100 + 32);
  expect_error(parsed([&](Directory& d) { d.levels[2].error_rms = nan; }), ErrorCode::corrupt_data, 100 + 64);
  expect_error(parsed([](Directory& d) { d.levels[0].error_max = -2; }), ErrorCode::corrupt_data, 100);
}

TEST(FileTest, WholeFileIsItsDirectoryAndItsPackets) {
  const std::vector<EncodedPacket> packets = sample_packets();
  const Bytes file = to_file(packets);
  const Result<ParsedFile> parsed = parse_file(file);
  ASSERT_TRUE(parsed.ok()) << text(parsed.error());
  ASSERT_EQ(parsed->packets.size(), packets.size());
  for (std::size_t k = 0; k < packets.size(); ++k) {
    EXPECT_TRUE(std::equal(packets[k].bytes.begin(), packets[k].bytes.end(), parsed->packets[k].begin(),
                           parsed->packets[k].end()));
  }
}

TEST(FileTest, DirectoryAndPacketsMustAgree) {
  const std::vector<EncodedPacket> packets = sample_packets();
  const Result<Directory> good = make_directory(spans(packets));
  ASSERT_TRUE(good.ok());
  auto parsed = [&](auto change) {
    Directory directory = *good;
    change(directory);
    Bytes file = serialize(directory);
    for (const EncodedPacket& packet : packets) file.insert(file.end(), packet.bytes.begin(), packet.bytes.end());
    return parse_file(file);
  };
  EXPECT_TRUE(parsed([](Directory&) {}).ok());
  expect_error(parsed([](Directory& d) { d.levels[1].vertices += 1; }), ErrorCode::corrupt_data, 1);
  expect_error(parsed([](Directory& d) { d.levels[2].faces += 1; }), ErrorCode::corrupt_data, 2);
  expect_error(parsed([](Directory& d) { d.levels[0].crc32c ^= 1; }), ErrorCode::corrupt_data, 0);
  expect_error(parsed([](Directory& d) { d.generation ^= 1; }), ErrorCode::wrong_mesh, 0);
  EXPECT_FALSE(parsed([](Directory& d) { d.levels[0].bytes += 1; }).ok());
  EXPECT_FALSE(parsed([](Directory& d) { d.levels[0].bytes = 0xFFFFFFFFu; }).ok());
  EXPECT_FALSE(parsed([](Directory& d) { d.levels.pop_back(); }).ok());
}

}  // namespace
}  // namespace pmcd::codec::testing
