// SPDX-License-Identifier: MIT
// The table of keys against the standard library's map, through growth and erasure.
#include "daemon/scheduler/key_map.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <map>
#include <memory>
#include <random>

namespace pmcd::scheduler {
namespace {

TEST(KeyMap, AsAMapWhateverComesAndGoes) {
  EXPECT_TRUE(rc::check("emplace and erase", [] {
    std::mt19937 random(*rc::gen::arbitrary<unsigned>());
    const unsigned range = *rc::gen::element(3U, 40U, 1'000U, 4'000'000'000U);
    const unsigned inserts = *rc::gen::inRange(2U, 9U);
    KeyMap<unsigned> table;
    std::map<std::uint64_t, unsigned> expected;
    for (unsigned n = 1; n < 600; ++n) {
      const std::uint64_t key = random() % range;
      if (random() % 10 < inserts) {
        const auto [value, made] = table.emplace(key);
        RC_ASSERT(made == !expected.contains(key));
        RC_ASSERT(*value == expected[key]);
        *value = expected[key] = n;
      } else {
        RC_ASSERT(table.erase(key) == (expected.erase(key) > 0));
      }
      RC_ASSERT(table.size() == expected.size());
    }
    std::map<std::uint64_t, unsigned> found;
    table.each([&found](std::uint64_t key, unsigned value) { found.emplace(key, value); });
    RC_ASSERT(found == expected);
    for (const auto& [key, value] : expected) RC_ASSERT(*table.find(key) == value);
    for (const auto& [key, value] : expected) RC_ASSERT(table.erase(key));
    RC_ASSERT(table.size() == 0U);
  }));
}

TEST(KeyMap, WhatIsErasedIsLetGo) {
  KeyMap<std::shared_ptr<int>> table;
  const auto value = std::make_shared<int>(7);
  *table.emplace(1).first = value;
  EXPECT_EQ(value.use_count(), 2);
  EXPECT_TRUE(table.erase(1));
  EXPECT_EQ(value.use_count(), 1);
  EXPECT_EQ(table.find(1), nullptr);
  EXPECT_FALSE(table.erase(1));
}

}  // namespace
}  // namespace pmcd::scheduler
