// SPDX-License-Identifier: MIT
// The rules that are one number a request (fifo, lcfs, spf, srpt), on examples worked out by hand from the table of
// rules: their order, what moves a key and what does not, and how ties break.
#include <gtest/gtest.h>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

TEST(FifoRule, SizeSpeedAndHistoryDoNotMatter) {
  Driver d(policy_of("fifo"));
  d.measure(1, 1'000);
  d.scheduler.acknowledged(1, 1'000'000, d.now);
  const auto first = d.ask(1, 1'000'000);
  d.now += milliseconds(1);
  const auto second = d.ask(2, 1);
  EXPECT_EQ(d.serve_all(), (Keys{first, second}));
}

TEST(FifoRule, WhatGoesBackStandsBehindThoseThatCameMeanwhile) {
  Driver d(policy_of("fifo"));
  const auto early = d.ask(1, 100);
  ASSERT_EQ(d.take(), early);
  d.now += milliseconds(1);
  const auto late = d.ask(2, 100);
  d.now += milliseconds(1);
  ASSERT_TRUE(d.scheduler.requeue(early, 40, d.now));
  EXPECT_EQ(d.scheduler.find(early)->asked_at, Time{0});
  EXPECT_EQ(d.serve_all(), (Keys{late, early}));
}

TEST(FifoRule, AWaitOutOfSightLosesNoPlace) {
  Driver d(policy_of("fifo"));
  const auto early = d.ask(1, 100);
  d.now += milliseconds(1);
  const auto late = d.ask(2, 100);
  d.scheduler.park(early);
  ASSERT_EQ(d.take(), late);
  d.scheduler.complete(late, d.now);
  EXPECT_EQ(d.take(), 0U) << "parked is out of sight";
  d.now += milliseconds(1);
  const auto last = d.ask(3, 100);
  d.scheduler.unpark(early, d.now);
  EXPECT_EQ(d.serve_all(), (Keys{early, last}));
}

TEST(LcfsRule, FewestAcknowledgedBytesOfAllMeshes) {
  Driver d(policy_of("lcfs"));
  d.scheduler.acknowledged(1, 500, d.now);
  d.scheduler.acknowledged(1, 500, d.now);
  d.scheduler.acknowledged(2, 999, d.now);
  const auto a = d.ask(1, 10, 0, 7);
  const auto b = d.ask(2, 10'000, 0, 8);
  const auto c = d.ask(3, 20'000);
  EXPECT_EQ(d.serve_all(), (Keys{c, b, a}));
}

TEST(LcfsRule, AcknowledgementMovesWhatWaits) {
  Driver d(policy_of("lcfs"));
  const auto a = d.ask(1, 10);
  const auto b = d.ask(2, 10);
  const auto a2 = d.ask(1, 10);
  d.scheduler.acknowledged(1, 1, d.now);
  EXPECT_EQ(d.serve_all(), (Keys{b, a, a2}));
}

TEST(LcfsRule, ANewSessionBeginsWithNothing) {
  Driver d(policy_of("lcfs"));
  d.scheduler.acknowledged(1, 100, d.now);
  d.scheduler.acknowledged(2, 50, d.now);
  d.scheduler.remove_session(1, d.now);
  const auto b = d.ask(2, 10);
  const auto a = d.ask(1, 10);
  EXPECT_EQ(d.serve_all(), (Keys{a, b}));
}

TEST(LcfsRule, TiesByQueuedAtThenSession) {
  Driver d(policy_of("lcfs"));
  const auto nine = d.ask(9, 10);
  const auto four = d.ask(4, 10);
  d.now += Time{1};
  const auto one = d.ask(1, 10);
  EXPECT_EQ(d.serve_all(), (Keys{four, nine, one}));
}

TEST(SpfRule, SmallestWholePacketAlsoWhenAPartIsSent) {
  Driver d(policy_of("spf"));
  const auto large = d.ask(1, 1'000);
  ASSERT_EQ(d.take(), large);
  const auto small = d.ask(2, 900);
  ASSERT_TRUE(d.scheduler.requeue(large, 999, d.now));
  EXPECT_EQ(d.serve_all(), (Keys{small, large})) << "one byte is left of 1,000, and still it is the larger packet";
}

TEST(SpfRule, TiesByQueuedAtThenSession) {
  Driver d(policy_of("spf"));
  const auto nine = d.ask(9, 10);
  const auto four = d.ask(4, 10);
  d.now += Time{1};
  const auto one = d.ask(1, 10);
  const auto smaller = d.ask(20, 9);
  EXPECT_EQ(d.serve_all(), (Keys{smaller, four, nine, one}));
}

TEST(SrptRule, RestOfTheWholeMeshOverSpeed) {
  Driver d(policy_of("srpt"));
  d.measure(1, 10'000);
  d.measure(2, 100'000);
  const auto slow = d.ask(1, 100, 19'900);      // 2 s
  const auto fast = d.ask(2, 50'000, 100'000);  // 1.5 s
  const auto end = d.ask(1, 5'000, 0, 2);       // 0.5 s
  EXPECT_EQ(d.serve_all(), (Keys{end, fast, slow}));
}

TEST(SrptRule, ScopePacketLooksAtThePacketAlone) {
  Driver d(policy_of("srpt", {{"scope", "packet"}}));
  d.measure(1, 10'000);
  d.measure(2, 100'000);
  const auto slow = d.ask(1, 100, 19'900);      // 0.01 s
  const auto fast = d.ask(2, 50'000, 100'000);  // 0.5 s
  EXPECT_EQ(d.serve_all(), (Keys{slow, fast}));
}

TEST(SrptRule, WhatIsSentCountsNoMore) {
  Driver d(policy_of("srpt"));
  d.measure(1, 10'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  ASSERT_EQ(d.take(), a);
  const auto b = d.ask(2, 500);
  ASSERT_TRUE(d.scheduler.requeue(a, 501, d.now));
  EXPECT_EQ(d.serve_all(), (Keys{a, b}));
}

TEST(SrptRule, NewSpeedMovesWhatWaits) {
  Driver d(policy_of("srpt"));
  d.measure(1, 10'000);
  d.measure(2, 20'000);
  const auto a = d.ask(1, 10'000);
  const auto b = d.ask(2, 10'000);
  d.measure(1, 40'000);
  EXPECT_EQ(d.serve_all(), (Keys{a, b}));
}

TEST(SrptRule, UnmeasuredCountsAsTheMedianOfTheMeasured) {
  Driver d(policy_of("srpt"));
  d.measure(1, 10'000);
  d.measure(2, 20'000);
  d.measure(3, 80'000);
  const auto unknown = d.ask(9, 20'000);  // 1 s at the median of 20 kB/s
  const auto a = d.ask(1, 9'000);         // 0.9 s
  const auto b = d.ask(2, 21'000);        // 1.05 s
  const auto c = d.ask(3, 88'000);        // 1.1 s
  EXPECT_EQ(d.serve_all(), (Keys{a, unknown, b, c}));
}

TEST(SrptRule, UnmeasuredCountsAsTheUplinkWhileNobodyIsMeasured) {
  Policy policy = policy_of("srpt");
  policy.uplink = 50'000;
  Driver d(policy);
  const auto unknown = d.ask(9, 50'000);  // 1 s
  d.measure(1, 10'000);
  const auto longer = d.ask(1, 11'000);  // 1.1 s
  const auto shorter = d.ask(1, 9'000);  // 0.9 s
  EXPECT_EQ(d.serve_all(), (Keys{shorter, unknown, longer}));
}

TEST(SrptRule, WhoAsksBeforeAnythingIsKnownIsNotHeldBackForIt) {
  Driver d(policy_of("srpt"));
  const auto unknown = d.ask(9, 1'000);
  d.measure(1, 10'000);
  const auto long_one = d.ask(1, 1'000'000);  // 100 s
  EXPECT_EQ(d.serve_all(), (Keys{unknown, long_one}));
}

TEST(SrptRule, TiesByQueuedAtThenSession) {
  Driver d(policy_of("srpt"));
  const auto nine = d.ask(9, 10);
  const auto four = d.ask(4, 10);
  d.now += Time{1};
  const auto one = d.ask(1, 10);
  EXPECT_EQ(d.serve_all(), (Keys{four, nine, one}));
}

}  // namespace
}  // namespace pmcd::scheduler
