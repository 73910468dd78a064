// SPDX-License-Identifier: GPL-3.0-or-later
// What the fuzzers do, without a fuzzer: every file of the corpora, and some thousand scripts drawn from a seed. A
// broken invariant ends the program with its sentence.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

namespace pmcd::fuzz {
namespace {

using Clock = std::chrono::steady_clock;

std::vector<std::byte> read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const Input bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> random_bytes(std::mt19937_64& random, std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::byte& b : bytes) b = static_cast<std::byte>(random() & 0xff);
  return bytes;
}

class Replay : public ::testing::TestWithParam<Target> {};

TEST_P(Replay, Corpus) {
  const std::filesystem::path folder = std::filesystem::path(PMCD_FUZZ_CORPUS) / GetParam().name;
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    SCOPED_TRACE(entry.path());
    GetParam().run(read_file(entry.path()));
    ++files;
  }
  EXPECT_GE(files, 5u);
  GetParam().run({});
}

TEST_P(Replay, RandomBytes) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 300; ++i) GetParam().run(random_bytes(random, random() % 200));
}

INSTANTIATE_TEST_SUITE_P(Targets, Replay, ::testing::ValuesIn(kTargets),
                         [](const auto& target) { return std::string(target.param.name); });

// The target that has a state gets more of them. Sanitizers make it slow: then fewer are drawn.
TEST(ReplaySession, RandomScripts) {
  std::mt19937_64 random(20);
  const auto end = Clock::now() + std::chrono::seconds(2);
  int scripts = 0;
  for (; scripts < 4'000 && (scripts < 200 || Clock::now() < end); ++scripts) {
    session(random_bytes(random, 50 + random() % 600));
  }
  RecordProperty("scripts", scripts);
}

}  // namespace
}  // namespace pmcd::fuzz
