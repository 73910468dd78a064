// SPDX-License-Identifier: MIT
// The stream as it was agreed: encode() gives exactly the golden files' bytes, and these decode, level by level, to the
// recorded meshes. A difference means that the format changed, or that two builds do not compute alike.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <span>

#include "codec/geometry/structure.h"
#include "codec/packet/base_header.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "codec/source.h"
#include "tests/codec/golden.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

const std::filesystem::path kFolder = PMCD_GOLDEN_DIR;

std::vector<std::byte> read_golden(const std::string& name) {
  std::ifstream file(kFolder / name, std::ios::binary);
  EXPECT_TRUE(file.is_open()) << name;
  const std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const auto bytes = std::as_bytes(std::span(content.data(), content.size()));
  return {bytes.begin(), bytes.end()};
}

std::set<std::string> recorded_lines() {
  std::ifstream file(kFolder / "levels.txt");
  std::set<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] != '#') lines.insert(line);
  }
  return lines;
}

TEST(Golden, EncodingGivesTheseBytes) {
  for (const GoldenMesh& golden : golden_meshes()) {
    const Result<Encoded> encoded = encode(golden.mesh, golden.options);
    ASSERT_TRUE(encoded.ok()) << golden.name << ": " << text(encoded.error());
    const std::vector<std::byte> now = to_file(encoded->packets);
    const std::vector<std::byte> then = read_golden(golden.name + ".pmcd");
    EXPECT_EQ(now.size(), then.size()) << golden.name;
    const auto at = std::mismatch(now.begin(), now.end(), then.begin(), then.end()).first - now.begin();
    EXPECT_TRUE(now == then) << golden.name << ".pmcd differs from byte " << at << " on";
  }
}

TEST(Golden, FilesDecodeToTheRecordedMeshes) {
  std::set<std::string> lines;
  for (const GoldenMesh& golden : golden_meshes()) {
    const std::vector<std::byte> file = read_golden(golden.name + ".pmcd");
    const Result<ParsedFile> parsed = parse_file(file);
    ASSERT_TRUE(parsed.ok()) << golden.name << ": " << text(parsed.error());
    std::vector<std::vector<std::byte>> packets;
    for (const auto& packet : parsed->packets) packets.emplace_back(packet.begin(), packet.end());
    const std::vector<std::string> levels = level_lines(golden.name, packets);
    ASSERT_EQ(levels.size(), packets.size()) << golden.name << " does not decode";
    lines.insert(levels.begin(), levels.end());
  }
  EXPECT_EQ(lines, recorded_lines());
}

// How often each answer comes to what a packet asks first.
struct Answers {
  std::map<std::uint32_t, int> structure;
  std::map<std::uint32_t, int> guessing;
  std::map<std::uint32_t, int> clear;
};

TEST(Golden, EveryWayToSpendTimeIsThere) {
  Answers answers;
  for (const GoldenMesh& golden : golden_meshes()) {
    const std::vector<std::byte> file = read_golden(golden.name + ".pmcd");
    const Result<ParsedFile> parsed = parse_file(file);
    ASSERT_TRUE(parsed.ok()) << golden.name;
    for (const auto& packet : parsed->packets) {
      const Result<PacketHeader> header = check_packet(packet);
      ASSERT_TRUE(header.ok()) << golden.name;
      const std::span<const std::byte> payload = packet.subspan(header->size);
      if (header->is_base()) {
        PacketReader reader(payload.subspan(parse_base_header(payload).value().size));
        ++answers.structure[reader.raw(0, 2)];
        continue;
      }
      PacketReader reader(payload);
      ++answers.guessing[reader.raw(0, 1)];
      ++answers.clear[reader.raw(0, 3)];
    }
  }
  for (const Structure structure : {Structure::none, Structure::values, Structure::all}) {
    EXPECT_GT(answers.structure[static_cast<std::uint32_t>(structure)], 0);
  }
  for (const Guessing guessing : {Guessing::never, Guessing::often}) {
    EXPECT_GT(answers.guessing[static_cast<std::uint32_t>(guessing)], 5);
  }
  EXPECT_GT(answers.clear[0], 5);
  EXPECT_GT(answers.clear[kNoneClear], 5);
}

TEST(Golden, LastLevelsAreTheGeneratedMeshes) {
  for (const GoldenMesh& golden : golden_meshes()) {
    EXPECT_EQ(round_trip(golden.mesh, golden.options), "") << golden.name;
  }
}

TEST(Golden, NoFileIsLeftOver) {
  std::set<std::string> wanted = {"README.md", "levels.txt"};
  for (const GoldenMesh& golden : golden_meshes()) wanted.insert(golden.name + ".pmcd");
  std::set<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(PMCD_GOLDEN_DIR)) {
    found.insert(entry.path().filename().string());
  }
  EXPECT_EQ(found, wanted);
}

}  // namespace
}  // namespace pmcd::codec::testing
