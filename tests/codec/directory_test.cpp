// SPDX-License-Identifier: MIT
// The directory and the file: written as the format says, read back, refused by name.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codec/packet/bytes.h"
#include "codec/packet/crc32c.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "tests/codec/expect_error.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

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
    EXPECT_GT(directory->generation, 0xFFFFFFFFu) << "all of it";
    EXPECT_EQ(directory->levels.back().vertices, 96u);
    EXPECT_EQ(directory->lattice.min, (Position{-4, -4, -1}));
    EXPECT_EQ(directory->box_min, directory->lattice.min);
  }
}

TEST(DirectoryTest, LatticesOfMultiplesKeepTheirUnits) {
  Random random(3);
  TriangleMesh mesh = sphere(3);
  for (Position& p : mesh.positions) {
    for (double& c : p) {
      const auto thousandths = static_cast<double>(std::lround(c * 1000)) + random.below(20);
      c = static_cast<double>(static_cast<float>(thousandths / 1000));
    }
  }
  const Result<Encoded> encoded = encode(mesh, {});
  ASSERT_TRUE(encoded.ok());
  const Result<Directory> directory = make_directory(spans(encoded->packets));
  ASSERT_TRUE(directory.ok()) << text(directory.error());
  EXPECT_EQ(directory->lattice.unit, (Unit{1, -3}));
  EXPECT_TRUE(directory->lattice.exact);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = mesh.positions[0][axis];
    for (const Position& p : mesh.positions) low = std::min(low, p[axis]);
    EXPECT_EQ(directory->box_min[axis], low);
  }
  const Bytes bytes = serialize(*directory);
  const Result<ParsedDirectory> parsed = parse_directory(bytes);
  ASSERT_TRUE(parsed.ok()) << text(parsed.error());
  EXPECT_EQ(parsed->directory.lattice.unit, directory->lattice.unit);
  EXPECT_EQ(parsed->directory.lattice.origin, directory->lattice.origin);
  EXPECT_TRUE(parsed->directory.lattice.exact);
  EXPECT_EQ(parsed->directory.box_max, directory->box_max);
  EXPECT_EQ(serialize(parsed->directory), bytes);
}

TEST(DirectoryTest, ComesBackAsWritten) {
  const std::vector<EncodedPacket> packets = sample_packets();
  Result<Directory> directory = make_directory(spans(packets));
  ASSERT_TRUE(directory.ok());
  directory->box_min = {-1, -2, -3.5};
  directory->box_max = {1e10, 2, 3.25};
  for (std::size_t k = 0; k < directory->levels.size(); ++k) {
    directory->levels[k].error_rms = 0.125 / static_cast<double>(1u << k);
    directory->levels[k].error_max = k == 0 ? -1 : 0.5;
  }
  Bytes bytes = serialize(*directory);
  EXPECT_LE(bytes.size(), 60 + 14 * directory->levels.size());
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
    EXPECT_EQ(got.levels[k].vertices, directory->levels[k].vertices);
    EXPECT_EQ(got.levels[k].faces, directory->levels[k].faces);
    EXPECT_EQ(got.levels[k].bits, directory->levels[k].bits);
    EXPECT_EQ(got.levels[k].crc32c, directory->levels[k].crc32c);
    EXPECT_EQ(got.levels[k].error_rms, directory->levels[k].error_rms);
    EXPECT_EQ(got.levels[k].error_max, directory->levels[k].error_max);
  }
  EXPECT_EQ(serialize(got), Bytes(bytes.begin(), bytes.end() - 17));
}

TEST(DirectoryTest, TellsThePrecisionOfEachLevel) {
  Random random(5);
  TriangleMesh mesh = torus(30, 20);
  jitter(mesh, 0.02, random);
  EncodeOptions options;
  options.bits = 16;
  const Result<Encoded> encoded = encode(mesh, options);
  ASSERT_TRUE(encoded.ok()) << text(encoded.error());
  const std::vector<EncodedPacket>& packets = encoded->packets;
  const Result<Directory> directory = make_directory(spans(packets));
  ASSERT_TRUE(directory.ok()) << text(directory.error());
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const Result<PacketHeader> header = parse_packet_header(packets[k].bytes);
    ASSERT_TRUE(header.ok());
    EXPECT_EQ(directory->levels[k].bits, directory->lattice.bits - header->missing_digits);
    EXPECT_GE(directory->levels[k].bits, k == 0 ? 1 : directory->levels[k - 1].bits);
  }
  EXPECT_LT(directory->levels.front().bits, directory->lattice.bits);
  EXPECT_EQ(directory->levels.back().bits, directory->lattice.bits);
}

TEST(DirectoryTest, NoneForPacketsWhoseDigitsCannotBe) {
  const std::vector<EncodedPacket> packets = sample_packets();
  auto made = [&](std::size_t k, std::uint8_t missing) {
    const Result<PacketHeader> honest = parse_packet_header(packets[k].bytes);
    PacketHeader header = *honest;
    header.missing_digits = missing;
    const Bytes forged = make_packet(header, std::span<const std::byte>(packets[k].bytes).subspan(header.size));
    auto all = spans(packets);
    all[k] = forged;
    return make_directory(all);
  };
  ASSERT_GE(packets.size(), 3u);
  EXPECT_TRUE(made(0, 9).ok());
  expect_error(made(0, 10), ErrorCode::corrupt_data, 0);
  expect_error(made(1, 9), ErrorCode::corrupt_data, 1);
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

// A directory of two levels with all that can be left out left out.
Directory small_directory() {
  Directory directory;
  directory.format_version = kFormatVersion;
  directory.lossless = true;
  directory.generation = 0x1122334455667788;
  directory.lattice.bits = 12;
  directory.lattice.min = {-4, 0.5, 0};
  directory.lattice.step = 8.0 / 4095;
  directory.box_min = directory.lattice.min;
  directory.box_max = directory.lattice.position({4095, 4095, 4095});
  directory.levels = {{300, 34, 64, 9, 0x01020304, -1, -1}, {20, 36, 68, 12, 0x05060708, -1, -1}};
  return directory;
}

Bytes content_of_small_directory(int flags = 0) {
  return bytes_of({flags,  //
                   12,    9,    0,    0,    0x80, 0xC0, 0,    0,    0,
                   0x3F,  0,    0,    0,    0,    0,    0,    0x80, 0x40,  // base header
                   0x88,  0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11});      // generation
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Bytes directory_around(const Bytes& content, int version = kFormatVersion) {
  Bytes bytes = bytes_of({'P', 'M', 'C', 'D', version});
  ByteWriter writer(bytes);
  writer.write_varint(content.size() + 4);
  bytes = bytes + content;
  writer.write(crc32c(bytes));
  return bytes;
}

TEST(DirectoryTest, StandsWhereTheFormatSays) {
  Directory directory = small_directory();
  const Bytes first = bytes_of({0xAC, 2, 68, 7, 9, 4, 3, 2, 1});
  const Bytes second = bytes_of({20, 4, 7, 3, 8, 7, 6, 5});
  const Bytes content = content_of_small_directory() + first + second;
  EXPECT_EQ(serialize(directory), directory_around(content));
  EXPECT_EQ(content.size(), 44u);
  // The corners that the lattice does not know, in float32.
  directory.box_min[1] = 0.75;
  directory.box_max[2] = 2;
  EXPECT_EQ(serialize(directory), directory_around(content_of_small_directory(0x22) +
                                                   bytes_of({0, 0, 0x40, 0x3F, 0, 0, 0, 0x40}) + first + second));
  // One that no float32 is.
  directory.box_min[1] = 0.5;
  directory.box_max[2] = 0.1;
  EXPECT_EQ(serialize(directory),
            directory_around(content_of_small_directory(0x60) +
                             bytes_of({0x9A, 0x99, 0x99, 0x99, 0x99, 0x99, 0xB9, 0x3F}) + first + second));
  // Errors of one level.
  directory = small_directory();
  directory.levels[1].error_rms = 0;
  directory.levels[1].error_max = 0.75;
  EXPECT_EQ(serialize(directory),
            directory_around(content_of_small_directory(0x80) + first + bytes_of({0xFF, 0xFF, 0xFF, 0xFF}) + second +
                             bytes_of({0, 0, 0, 0xC6})));
}

void expect_same(const Directory& a, const Directory& b) {
  EXPECT_EQ(a.lossless, b.lossless);
  EXPECT_EQ(a.generation, b.generation);
  EXPECT_EQ(a.lattice.min, b.lattice.min);
  EXPECT_EQ(a.lattice.step, b.lattice.step);
  EXPECT_EQ(a.box_min, b.box_min);
  EXPECT_EQ(a.box_max, b.box_max);
  ASSERT_EQ(a.levels.size(), b.levels.size());
  for (std::size_t k = 0; k < a.levels.size(); ++k) {
    EXPECT_EQ(a.levels[k].bytes, b.levels[k].bytes);
    EXPECT_EQ(a.levels[k].vertices, b.levels[k].vertices);
    EXPECT_EQ(a.levels[k].faces, b.levels[k].faces);
    EXPECT_EQ(a.levels[k].bits, b.levels[k].bits);
    EXPECT_EQ(a.levels[k].crc32c, b.levels[k].crc32c);
    EXPECT_EQ(a.levels[k].error_rms, b.levels[k].error_rms);
    EXPECT_EQ(a.levels[k].error_max, b.levels[k].error_max);
  }
}

TEST(DirectoryTest, EveryFormComesBack) {
  auto kept = [](auto change) {
    Directory directory = small_directory();
    change(directory);
    const Bytes bytes = serialize(directory);
    const Result<ParsedDirectory> parsed = parse_directory(bytes);
    ASSERT_TRUE(parsed.ok()) << text(parsed.error());
    EXPECT_EQ(parsed->size, bytes.size());
    expect_same(parsed->directory, directory);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      expect_error(parse_directory(std::span<const std::byte>(bytes).first(length)), ErrorCode::truncated, length);
    }
  };
  kept([](Directory&) {});
  kept([](Directory& d) { d.box_max = {1, -2, 0.1}; });
  kept([](Directory& d) { d.box_min = {-0.0, 1e300, 7}; });
  kept([](Directory& d) { d.lattice.scalar = Scalar::float64; });
  kept([](Directory& d) { d.lattice.step = 0.3; });
  kept([](Directory& d) { d.levels[0].vertices = 0xFFFFFFFFu; });
  kept([](Directory& d) { d.levels[1].vertices = 0xFFFFFFFFu; });
  kept([](Directory& d) { d.levels[1] = {0xFFFFFFFFu, 0, 0xFFFFFFFFu, 12, 0, -1, 0.5}; });
  kept([](Directory& d) { d.levels.resize(1000, d.levels[1]); });
}

TEST(DirectoryTest, ErrorsAreRounded) {
  Directory directory = small_directory();
  directory.levels[0].error_rms = 0.0123456789;
  directory.levels[0].error_max = -7;
  directory.levels[1].error_max = std::nan("");
  const Result<ParsedDirectory> parsed = parse_directory(serialize(directory));
  ASSERT_TRUE(parsed.ok());
  EXPECT_NEAR(parsed->directory.levels[0].error_rms, 0.0123456789, 0.0123456789 / 2048);
  EXPECT_EQ(parsed->directory.levels[0].error_max, -1);
  EXPECT_EQ(parsed->directory.levels[1].error_max, -1);
  EXPECT_EQ(serialize(parsed->directory), serialize(directory));
}

TEST(DirectoryTest, ContentThatMakesNoSenseIsRefusedBehindARightChecksum) {
  auto parsed = [](const Bytes& content) { return parse_directory(directory_around(content)); };
  const Bytes level = bytes_of({20, 4, 7, 12, 8, 7, 6, 5});
  const Bytes head = content_of_small_directory();
  constexpr std::size_t kContent = 6;  // "PMCD", version, one byte of length
  constexpr std::size_t kLevels = kContent + 27;
  ASSERT_TRUE(parsed(head + level).ok());
  expect_error(parse_directory(directory_around(head + level, 200)), ErrorCode::unsupported_version, 200);
  expect_error(parsed({}), ErrorCode::corrupt_data, kContent);
  expect_error(parsed(head), ErrorCode::corrupt_data, kLevels);  // no level
  for (std::size_t length = 1; length < head.size(); ++length) {
    const Result<ParsedDirectory> cut = parsed(Bytes(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(length)));
    ASSERT_FALSE(cut.ok());
    EXPECT_EQ(cut.error().code, ErrorCode::corrupt_data) << text(cut.error());
  }
  for (std::size_t length = 1; length < level.size(); ++length) {
    expect_error(parsed(head + level + Bytes(level.begin(), level.begin() + static_cast<std::ptrdiff_t>(length))),
                 ErrorCode::corrupt_data, kLevels + level.size());
  }
  Bytes bits = head + level;
  bits[1] = std::byte{99};
  expect_error(parsed(bits), ErrorCode::corrupt_data, kContent + 1);
  Bytes feature = head + level;
  feature[2] |= std::byte{0x80};
  expect_error(parsed(feature), ErrorCode::unsupported_feature, kContent + 2);
  // Boxes: not finite, what the lattice knows, wide without need, cut off.
  expect_error(parsed(content_of_small_directory(0x22) + bytes_of({0, 0, 0x40, 0x3F, 0, 0, 0xC0, 0x7F}) + level),
               ErrorCode::corrupt_data, kLevels);
  expect_error(parsed(content_of_small_directory(0x02) + bytes_of({0, 0, 0, 0x3F}) + level), ErrorCode::corrupt_data,
               kContent);
  expect_error(parsed(content_of_small_directory(0x42) + bytes_of({0, 0, 0, 0, 0, 0, 0, 0x40}) + level),
               ErrorCode::corrupt_data, kContent);
  expect_error(parsed(content_of_small_directory(0x40) + level), ErrorCode::corrupt_data, kContent);
  expect_error(parsed(content_of_small_directory(0x3F) + level), ErrorCode::corrupt_data, kLevels);
  // Errors although none is measured.
  expect_error(parsed(content_of_small_directory(0x80) + level + bytes_of({0xFF, 0xFF, 0xFF, 0xFF})),
               ErrorCode::corrupt_data, kContent);
  // Numbers of a level.
  const Bytes crc = bytes_of({8, 7, 6, 5});
  auto second = [&](std::initializer_list<int> numbers, int more_bits = 0) {
    return parsed(head + level + bytes_of(numbers) + bytes_of({more_bits}) + crc);
  };
  constexpr std::size_t kSecond = kLevels + 8;
  EXPECT_TRUE(second({15, 0, 7}).ok());
  expect_error(second({14, 0, 7}), ErrorCode::corrupt_data, kSecond);            // shorter than a header
  expect_error(second({0x94, 0, 0, 7}), ErrorCode::corrupt_data, kSecond);       // longer than it needs to be
  expect_error(second({20, 0x84, 0, 7}), ErrorCode::corrupt_data, kSecond + 1);  // the same
  expect_error(second({20, 4, 0x87, 0}), ErrorCode::corrupt_data, kSecond + 2);  // the same
  expect_error(second({20, 5, 7}), ErrorCode::corrupt_data, kSecond);            // three vertices less than two
  expect_error(second({20, 4, 17}), ErrorCode::corrupt_data, kSecond);           // nine faces less than eight
  expect_error(second({0x80, 0x80, 0x80, 0x80, 0x10, 4, 7}), ErrorCode::corrupt_data, kSecond);   // 2^32 bytes
  expect_error(second({20, 0xFC, 0xFF, 0xFF, 0xFF, 0x1F, 0}), ErrorCode::corrupt_data, kSecond);  // 2^32 vertices
  expect_error(second({20, 4, 7}, 1), ErrorCode::corrupt_data, kSecond);                          // 13 bits of 12
  expect_error(second({20, 4, 7}, 255), ErrorCode::corrupt_data, kSecond);                        // they never fall
  expect_error(parsed(head + bytes_of({20, 4, 7, 0}) + crc), ErrorCode::corrupt_data, kLevels);   // none
  const Bytes coarse = bytes_of({20, 4, 7, 11}) + crc;
  expect_error(parsed(head + coarse), ErrorCode::corrupt_data, kLevels + 8);  // the last level has not all
  EXPECT_TRUE(parsed(head + coarse + bytes_of({15, 0, 7, 1}) + crc).ok());
  // The number of bytes itself.
  const Bytes good = directory_around(head + level);
  for (const int few : {0, 3}) {
    Bytes bytes = good;
    bytes[5] = static_cast<std::byte>(few);
    expect_error(parse_directory(bytes), ErrorCode::corrupt_data, 5);
  }
  Bytes longer = good;
  longer[5] |= std::byte{0x80};
  longer.insert(longer.begin() + 6, std::byte{0});
  expect_error(parse_directory(longer), ErrorCode::corrupt_data, 5);
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
  expect_error(parsed([](Directory& d) { d.levels[0].bits -= 1; }), ErrorCode::corrupt_data, 0);
  expect_error(parsed([](Directory& d) { d.levels[0].crc32c ^= 1; }), ErrorCode::corrupt_data, 0);
  expect_error(parsed([](Directory& d) { d.generation ^= 1; }), ErrorCode::wrong_mesh, 0);
  EXPECT_FALSE(parsed([](Directory& d) { d.levels[0].bytes += 1; }).ok());
  EXPECT_FALSE(parsed([](Directory& d) { d.levels[0].bytes = 0xFFFFFFFFu; }).ok());
  EXPECT_FALSE(parsed([](Directory& d) { d.levels.pop_back(); }).ok());
}

}  // namespace
}  // namespace pmcd::codec::testing
