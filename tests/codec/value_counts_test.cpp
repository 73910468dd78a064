// SPDX-License-Identifier: MIT
// Values that came often: the most frequent for its distance is answered, and another size of cells forgets them.
#include "codec/geometry/value_counts.h"

#include <gtest/gtest.h>

namespace pmcd::codec::testing {
namespace {

TEST(ValueCounts, FrequentAndNearWins) {
  ValueCounts counts;
  counts.begin(0);
  std::int32_t value = -1;
  EXPECT_EQ(counts.best_near(100.2, 10, value), 0u);
  EXPECT_EQ(value, 100) << "the centre, when there is none";
  for (int i = 0; i < 5; ++i) counts.learn(104);
  counts.learn(101);
  EXPECT_EQ(counts.best_near(100.2, 5, value), 1u) << "one at 0.8 scores more than five at 3.8";
  EXPECT_EQ(value, 101);
  for (int i = 0; i < 5; ++i) counts.learn(104);
  EXPECT_EQ(counts.best_near(102.9, 10, value), 10u);
  EXPECT_EQ(value, 104);
  EXPECT_EQ(counts.best_near(100.2, 1.5, value), 1u);
  EXPECT_EQ(counts.best_near(90, 2, value), 0u) << "out of reach";
}

TEST(ValueCounts, CountsEndAt255AndWrapAround) {
  ValueCounts counts;
  counts.begin(0);
  for (int i = 0; i < 300; ++i) counts.learn(7);
  std::int32_t value = -1;
  EXPECT_EQ(counts.best_near(7, 1, value), 255u);
  EXPECT_EQ(counts.best_near(7 + (1 << 14), 1, value), 255u) << "as many slots as that";
  EXPECT_EQ(value, 7 + (1 << 14));
}

TEST(ValueCounts, AnotherSizeOfCellsForgets) {
  ValueCounts counts;
  counts.begin(2);
  counts.learn(3);
  std::int32_t value = -1;
  counts.begin(2);
  EXPECT_EQ(counts.best_near(3, 1, value), 1u);
  counts.begin(1);
  EXPECT_EQ(counts.best_near(3, 1, value), 0u);
}

}  // namespace
}  // namespace pmcd::codec::testing
