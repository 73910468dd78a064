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

TEST(ValueCounts, FourAreLookedAtAtATime) {
  // Reach 1 about 90: 89 to 91, and 92, which makes them four.
  auto count_of = [](std::int32_t learnt) {
    ValueCounts counts;
    counts.begin(0);
    counts.learn(learnt);
    std::int32_t value = -1;
    const std::size_t count = counts.best_near(90, 1, value);
    EXPECT_EQ(value, count > 0 ? learnt : 90);
    return count;
  };
  for (std::int32_t near : {89, 90, 91, 92}) EXPECT_EQ(count_of(near), 1u) << near;
  for (std::int32_t far : {88, 93}) EXPECT_EQ(count_of(far), 0u) << far;
}

TEST(ValueCounts, TheLastSlotsAndTheFirstLieTogether) {
  constexpr std::int32_t kSlots = 1 << 14;
  for (std::int32_t value = kSlots - 2; value < kSlots + 3; ++value) {
    ValueCounts counts;
    counts.begin(0);
    counts.learn(value);
    std::int32_t best = -1;
    EXPECT_EQ(counts.best_near(kSlots - 1, 2, best), 1u) << value;
    EXPECT_EQ(best, value);
  }
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
