// SPDX-License-Identifier: MIT
// Sorted blocks against the standard library's multiset, through many splits and until nothing is left.
#include "daemon/scheduler/sorted_blocks.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <random>
#include <set>
#include <vector>

namespace pmcd::scheduler {
namespace {

template <typename T>
std::vector<T> listed(const SortedBlocks<T>& blocks) {
  std::vector<T> all;
  blocks.each([&all](const T& value) {
    all.push_back(value);
    return true;
  });
  return all;
}

/// So large that a block holds only sixteen.
struct Large {
  int value = 0;
  char filling[300] = {};
  bool operator<(const Large& other) const { return value < other.value; }
};

TEST(SortedBlocks, AsAMultisetWhateverComesAndGoes) {
  EXPECT_TRUE(rc::check("insert and erase", [] {
    std::mt19937 random(*rc::gen::arbitrary<unsigned>());
    const unsigned range = *rc::gen::element(3U, 50U, 100'000U);
    const unsigned inserts = *rc::gen::inRange(2U, 9U);
    SortedBlocks<Large> blocks;
    std::multiset<int> expected;
    for (int n = 0; n < 600; ++n) {
      const int value = static_cast<int>(random() % range);
      if (random() % 10 < inserts) {
        blocks.insert({value});
        expected.insert(value);
      } else {
        const auto it = expected.lower_bound(value);
        const int gone = it != expected.end() && random() % 4 != 0 ? *it : value;
        const auto found = expected.find(gone);
        RC_ASSERT(blocks.erase({gone}) == (found != expected.end()));
        if (found != expected.end()) expected.erase(found);
      }
      RC_ASSERT(blocks.size() == expected.size());
      RC_ASSERT(blocks.empty() == expected.empty());
      if (expected.empty()) continue;
      RC_ASSERT(blocks.front().value == *expected.begin());
      RC_ASSERT(blocks.back().value == *expected.rbegin());
    }
    std::vector<int> values;
    for (const Large& one : listed(blocks)) values.push_back(one.value);
    RC_ASSERT(values == std::vector<int>(expected.begin(), expected.end()));
    for (const int value : values) RC_ASSERT(blocks.erase({value}));
    RC_ASSERT(blocks.empty());
    RC_ASSERT(!blocks.erase({0}));
  }));
}

TEST(SortedBlocks, AQueueOfTimes) {
  SortedBlocks<int> blocks;
  for (int n = 0; n < 100'000; ++n) blocks.insert(n);
  for (int n = 0; n < 100'000; ++n) {
    ASSERT_EQ(blocks.front(), n);
    ASSERT_TRUE(blocks.erase(n));
    blocks.insert(100'000 + n);
  }
  EXPECT_EQ(blocks.size(), 100'000U);
  EXPECT_EQ(blocks.back(), 199'999);
}

TEST(SortedBlocks, EachStopsWhenTold) {
  SortedBlocks<int> blocks;
  for (int n = 5'000; n > 0; --n) blocks.insert(n);
  int last = 0;
  blocks.each([&last](int value) {
    EXPECT_EQ(value, last + 1);
    last = value;
    return value < 3'000;
  });
  EXPECT_EQ(last, 3'000);
}

}  // namespace
}  // namespace pmcd::scheduler
