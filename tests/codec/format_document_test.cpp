// SPDX-License-Identifier: MIT
// docs/FORMAT.md against the code: its example is a file that is read as the document says, and written just so.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "codec/packet/base_header.h"
#include "codec/packet/directory.h"
#include "codec/packet/error_value.h"
#include "codec/packet/header.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

using Bytes = std::vector<std::byte>;

std::vector<std::string> lines_of_example() {
  std::ifstream in(PMCD_FORMAT_DOCUMENT);
  std::vector<std::string> lines;
  bool below = false;
  bool inside = false;
  for (std::string line; std::getline(in, line);) {
    if (line == "### Example") below = true;
    if (!below) continue;
    if (line == "```") {
      if (inside) break;
      inside = true;
    } else if (inside) {
      lines.push_back(line);
    }
  }
  return lines;
}

/// The bytes of the example: what stands before `#` in each line, in hexadecimal.
Bytes bytes_of_example() {
  Bytes bytes;
  for (const std::string& line : lines_of_example()) {
    std::istringstream in(line.substr(0, line.find('#')));
    for (std::string byte; in >> byte;) bytes.push_back(static_cast<std::byte>(std::stoul(byte, nullptr, 16)));
  }
  return bytes;
}

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    text += kDigits[static_cast<unsigned>(byte) >> 4];
    text += kDigits[static_cast<unsigned>(byte) & 15];
    text += ' ';
  }
  return text;
}

Bytes digits(const char* text) {
  Bytes bytes;
  for (; *text != '\0'; ++text) bytes.push_back(static_cast<std::byte>(*text));
  return bytes;
}

constexpr std::uint64_t kGeneration = 0x1122334455667788;

Lattice lattice_of_example() {
  Lattice lattice;
  lattice.bits = 12;
  lattice.min = {-4, 0.5, 0};
  lattice.step = 8.0 / 4095;
  return lattice;
}

std::vector<Bytes> packets_of_example() {
  Bytes payload;
  append_base_header(payload, lattice_of_example(), true);
  const Bytes coded = digits("123");
  payload.insert(payload.end(), coded.begin(), coded.end());
  PacketHeader base;
  base.vertices = 34;
  base.faces = 64;
  base.mesh_hash = 0xAABBCCDDEEFF0011;
  base.generation = kGeneration;
  base.missing_digits = 3;
  PacketHeader last = base;
  last.last = true;
  last.level = 1;
  last.missing_digits = 0;
  last.vertices = 300;
  last.faces = 590;
  last.mesh_hash = 0x0102030405060708;
  return {make_packet(base, payload), make_packet(last, digits("4567"))};
}

TEST(FormatDocument, ExampleIsReadAsItSays) {
  const Bytes example = bytes_of_example();
  const Result<ParsedFile> file = parse_file(example);
  ASSERT_TRUE(file.ok()) << text(file.error());
  const Directory& directory = file->directory;
  EXPECT_EQ(directory.format_version, 0);
  EXPECT_TRUE(directory.lossless);
  EXPECT_EQ(directory.generation, kGeneration);
  EXPECT_EQ(directory.lattice.scalar, Scalar::float32);
  EXPECT_EQ(directory.lattice.bits, 12u);
  EXPECT_EQ(directory.lattice.min, (Position{-4, 0.5, 0}));
  EXPECT_EQ(directory.lattice.step, 8.0 / 4095);
  EXPECT_EQ(directory.box_min, (Position{-4, 0.5, 0}));
  EXPECT_EQ(directory.box_max, (Position{4, 2.5, 1}));
  ASSERT_EQ(directory.levels.size(), 2u);
  EXPECT_EQ(directory.levels[0].vertices, 34u);
  EXPECT_EQ(directory.levels[0].faces, 64u);
  EXPECT_EQ(directory.levels[0].bits, 9);
  EXPECT_EQ(directory.levels[0].error_rms, 0.009765625);
  EXPECT_EQ(directory.levels[0].error_max, 0.046875);
  EXPECT_EQ(directory.levels[1].vertices, 300u);
  EXPECT_EQ(directory.levels[1].faces, 590u);
  EXPECT_EQ(directory.levels[1].bits, 12);
  EXPECT_EQ(directory.levels[1].error_rms, 0);
  EXPECT_EQ(directory.levels[1].error_max, 0);
  const std::vector<Bytes> packets = packets_of_example();
  ASSERT_EQ(file->packets.size(), packets.size());
  for (std::size_t k = 0; k < packets.size(); ++k) {
    EXPECT_EQ(hex(Bytes(file->packets[k].begin(), file->packets[k].end())), hex(packets[k])) << k;
    EXPECT_EQ(directory.levels[k].bytes, packets[k].size());
  }
}

TEST(FormatDocument, ExampleIsWrittenSo) {
  const std::vector<Bytes> packets = packets_of_example();
  Result<Directory> directory = make_directory(std::vector<std::span<const std::byte>>{packets[0], packets[1]});
  ASSERT_TRUE(directory.ok()) << text(directory.error());
  directory->box_max = {4, 2.5, 1};
  directory->levels[0].error_rms = 0.009765625;
  directory->levels[0].error_max = 0.046875;
  directory->levels[1].error_rms = directory->levels[1].error_max = 0;
  Bytes file = serialize(*directory);
  for (const Bytes& packet : packets) file.insert(file.end(), packet.begin(), packet.end());
  EXPECT_EQ(hex(bytes_of_example()), hex(file));
}

}  // namespace
}  // namespace pmcd::codec::testing
