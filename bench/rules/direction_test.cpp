// SPDX-License-Identifier: MIT
// One direction of the bench's relay: delay, rate, queue, and loss that repeats.
#include "bench/rules/direction.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <vector>

namespace pmcd::bench {
namespace {

using std::chrono::milliseconds;

const Clock::time_point kStart = Clock::time_point(std::chrono::seconds(1000));

std::vector<std::byte> packet(std::size_t bytes, int mark = 0) {
  return std::vector<std::byte>(bytes, static_cast<std::byte>(mark));
}

TEST(RelayDirection, DelayAloneKeepsOrderAndDistances) {
  Direction direction({.delay = milliseconds(75)});
  direction.arrive(packet(10, 1), kStart);
  direction.arrive(packet(20, 2), kStart + milliseconds(5));
  ASSERT_EQ(direction.due(), kStart + milliseconds(75));
  EXPECT_FALSE(direction.depart(kStart + milliseconds(74)));
  EXPECT_EQ(direction.depart(kStart + milliseconds(75)), packet(10, 1));
  EXPECT_FALSE(direction.depart(kStart + milliseconds(75)));
  EXPECT_EQ(direction.depart(kStart + milliseconds(80)), packet(20, 2));
  EXPECT_FALSE(direction.due());
}

TEST(RelayDirection, RateIsThatOfTheBytes) {
  Direction direction({.delay = milliseconds(10), .bytes_per_second = 1000});
  direction.arrive(packet(100), kStart);
  direction.arrive(packet(50), kStart);
  EXPECT_EQ(direction.due(), kStart + milliseconds(110));
  ASSERT_TRUE(direction.depart(kStart + milliseconds(110)));
  EXPECT_EQ(direction.due(), kStart + milliseconds(160));
  ASSERT_TRUE(direction.depart(kStart + milliseconds(160)));
  // The line stood still meanwhile; that is not made up for.
  direction.arrive(packet(100), kStart + milliseconds(1000));
  EXPECT_EQ(direction.due(), kStart + milliseconds(1110));
}

TEST(RelayDirection, QueueDropsWhatFindsNoRoom) {
  Direction direction({.queue_bytes = 250, .bytes_per_second = 1000});
  for (int i = 0; i < 5; ++i) direction.arrive(packet(100, i), kStart);
  EXPECT_EQ(direction.counts().crowded, 3U);
  EXPECT_EQ(direction.depart(kStart + milliseconds(100)), packet(100, 0));
  // One packet has left the line; there is room for another.
  direction.arrive(packet(100, 9), kStart + milliseconds(100));
  EXPECT_EQ(direction.counts().crowded, 3U);
  EXPECT_EQ(direction.depart(kStart + milliseconds(200)), packet(100, 1));
  EXPECT_EQ(direction.depart(kStart + milliseconds(300)), packet(100, 9));
}

TEST(RelayDirection, QueueDoesNotCountWhatIsUnderWay) {
  Direction direction({.delay = milliseconds(10'000), .queue_bytes = 150, .bytes_per_second = 1000});
  for (int i = 0; i < 20; ++i) direction.arrive(packet(100), kStart + milliseconds(100 * i));
  EXPECT_EQ(direction.counts().crowded, 0U);
}

std::vector<int> survivors(std::uint64_t seed, double loss) {
  Direction direction({.loss = loss, .seed = seed});
  std::vector<int> kept;
  for (int i = 0; i < 1000; ++i) {
    direction.arrive(packet(1), kStart);
    if (direction.depart(kStart)) kept.push_back(i);
  }
  EXPECT_EQ(direction.counts().lost + kept.size(), 1000U);
  return kept;
}

TEST(RelayDirection, LossRepeatsWithItsSeed) {
  EXPECT_EQ(survivors(7, 0.1), survivors(7, 0.1));
  EXPECT_NE(survivors(7, 0.1), survivors(8, 0.1));
  EXPECT_NEAR(static_cast<double>(survivors(7, 0.1).size()), 900, 40);
  EXPECT_EQ(survivors(7, 0).size(), 1000U);
  EXPECT_EQ(survivors(7, 1).size(), 0U);
}

}  // namespace
}  // namespace pmcd::bench
