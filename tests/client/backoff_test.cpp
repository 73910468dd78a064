// SPDX-License-Identifier: MIT
// Pauses that grow, are drawn, are cut, and end.
#include "client/backoff.h"

#include <gtest/gtest.h>

#include <vector>

namespace pmcd::client {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;

const Backoff::Time kStart{};

RetryOptions exact() {
  RetryOptions options;
  options.jitter = 0;
  return options;
}

TEST(Backoff, DoublesUpToTheLongest) {
  Backoff backoff(exact(), kStart, 1);
  std::vector<milliseconds> pauses;
  while (const auto pause = backoff.failed(kStart)) pauses.push_back(*pause);
  EXPECT_EQ(pauses, (std::vector<milliseconds>{500ms, 1s, 2s, 4s, 8s, 16s, 30s, 30s, 30s, 30s}));
  EXPECT_EQ(backoff.tries(), 11u);
}

TEST(Backoff, ProgressBeginsAnew) {
  Backoff backoff(exact(), kStart, 1);
  EXPECT_EQ(backoff.failed(kStart), 500ms);
  EXPECT_EQ(backoff.failed(kStart), 1s);
  backoff.progress(kStart + 9s);
  EXPECT_EQ(backoff.tries(), 0u);
  EXPECT_EQ(backoff.failed(kStart + 9s), 500ms);
}

TEST(Backoff, JitterStaysInItsBoundsAndDiffers) {
  RetryOptions options;
  options.most_tries = RetryOptions::kAnyNumber;
  options.first_pause = options.longest_pause = 1000ms;
  options.jitter = 0.25;
  Backoff one(options, kStart, 1);
  Backoff other(options, kStart, 2);
  bool differ = false;
  milliseconds least = 1000ms;
  for (int i = 0; i < 1000; ++i) {
    const milliseconds a = *one.failed(kStart);
    differ = differ || a != *other.failed(kStart);
    EXPECT_LE(a, 1000ms);
    least = std::min(least, a);
  }
  EXPECT_TRUE(differ);
  EXPECT_GE(least, 750ms);
  EXPECT_LT(least, 760ms);
}

TEST(Backoff, GivesUpAfterATimeWithTheLastPauseCut) {
  RetryOptions options = exact();
  options.give_up_after = 5s;
  Backoff backoff(options, kStart, 1);
  EXPECT_EQ(backoff.failed(kStart), 500ms);
  EXPECT_EQ(backoff.failed(kStart + 500ms), 1s);
  EXPECT_EQ(backoff.failed(kStart + 3500ms), 1500ms);
  EXPECT_EQ(backoff.failed(kStart + 5s), std::nullopt);
}

TEST(Backoff, NoTriesForgiveNothing) {
  RetryOptions options = exact();
  options.most_tries = 0;
  EXPECT_EQ(Backoff(options, kStart, 1).failed(kStart), std::nullopt);
}

TEST(Backoff, AnyNumberNeverOverflows) {
  RetryOptions options = exact();
  options.most_tries = RetryOptions::kAnyNumber;
  Backoff backoff(options, kStart, 1);
  for (int i = 0; i < 5000; ++i) ASSERT_TRUE(backoff.failed(kStart).has_value());
  EXPECT_EQ(backoff.failed(kStart), 30s);
}

}  // namespace
}  // namespace pmcd::client
