// SPDX-License-Identifier: MIT
// The fair sojourn protocol: jobs in the order in which equal sharing would finish them, on examples worked out by
// hand. How equal sharing itself is reckoned is tested with VirtualServer.
#include <gtest/gtest.h>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

Policy fsp(double uplink = 100'000) {
  Policy policy = policy_of("fsp");
  policy.uplink = uplink;
  return policy;
}

TEST(FspRule, InTheOrderInWhichEqualSharingFinishes) {
  Driver d(fsp());
  const auto large = d.ask(1, 10, 299'990);
  const auto small = d.ask(2, 50'000, 50'000);
  d.now += seconds(1);
  // 250,000 and 50,000 are left of the first two: by then 75,000 finish after the second.
  const auto late = d.ask(3, 75'000);
  d.now += milliseconds(1);
  const auto quick = d.ask(4, 20'000);
  EXPECT_EQ(d.serve_all(), (Keys{quick, small, late, large}));
}

TEST(FspRule, WhatHasFinishedVirtuallyGoesFirstInItsOrder) {
  Driver d(fsp());
  const auto b = d.ask(2, 60'000);
  const auto a = d.ask(1, 50'000);
  d.now += seconds(2);  // both are through: a at 1 s, b at 1.1 s
  const auto tiny = d.ask(3, 1);
  EXPECT_EQ(d.serve_all(), (Keys{a, b, tiny}));
}

TEST(FspRule, AJobIsCappedByItsClientsSpeed) {
  Driver d(fsp());
  d.measure(1, 10'000);
  const auto slow = d.ask(1, 30'000);   // 3 s, at its speed
  const auto fast = d.ask(2, 240'000);  // 2.7 s, at 90,000 a second
  EXPECT_EQ(d.serve_all(), (Keys{fast, slow}));
}

TEST(FspRule, NewSpeedMovesTheJob) {
  Driver d(fsp());
  d.measure(1, 1'000);
  const auto first = d.ask(1, 100'000);
  const auto second = d.ask(2, 9'000'000);  // 91 s, at 99,000
  ASSERT_EQ(d.scheduler.ranking(1, d.now).front().key, second);
  d.measure(1, 90'000);
  EXPECT_EQ(d.serve_all(), (Keys{first, second}));
}

TEST(FspRule, OneJobForAllPacketsOfAMesh) {
  Driver d(fsp());
  const auto base = d.ask(1, 1'000, 99'000, 7);
  const auto other = d.ask(2, 80'000, 0, 7);
  EXPECT_EQ(d.take(), other);
  d.now += seconds(1);
  d.scheduler.complete(other, d.now);
  ASSERT_EQ(d.take(), base);
  d.scheduler.complete(base, d.now);
  // At 1 s, 50,000 are left of its job on paper, whatever it has really got.
  const auto third = d.ask(3, 49'000);
  const auto next = d.ask(1, 1'000, 98'000, 7, 1);
  EXPECT_EQ(d.take(), third);
  d.scheduler.complete(third, d.now);
  const auto fourth = d.ask(4, 51'000);
  EXPECT_EQ(d.serve_all(), (Keys{next, fourth}));
}

TEST(FspRule, MeshesOfASessionAreJobsOfTheirOwn) {
  Driver d(fsp());
  const auto a = d.ask(1, 70'000, 0, 7);
  const auto b = d.ask(1, 30'000, 0, 8);
  const auto c = d.ask(2, 50'000, 0, 7);
  EXPECT_EQ(d.serve_all(), (Keys{b, c, a}));
}

TEST(FspRule, AMeshAskedForAnewIsANewJob) {
  Driver d(fsp());
  const auto base = d.ask(1, 1'000, 9'000, 7);
  ASSERT_EQ(d.take(), base);
  d.scheduler.complete(base, d.now);
  d.now += seconds(10);  // finished on paper; the client asked for no more
  const auto other = d.ask(2, 5'000);
  const auto again = d.ask(1, 1'000, 9'000, 7);
  EXPECT_EQ(d.serve_all(), (Keys{other, again}));
}

TEST(FspRule, AnInterruptedOrParkedBasePacketBeginsNoNewJob) {
  Driver d(fsp());
  const auto base = d.ask(1, 1'000, 9'000, 7);
  ASSERT_EQ(d.take(), base);
  d.now += seconds(10);
  ASSERT_TRUE(d.scheduler.requeue(base, 10, d.now));
  d.scheduler.park(base);
  d.scheduler.unpark(base, d.now);
  const auto other = d.ask(2, 5'000);
  EXPECT_EQ(d.serve_all(), (Keys{base, other})) << "finished on paper long ago";
}

TEST(FspRule, ServedJobsStillTakeTheirShareOnPaper) {
  Driver d(fsp());
  const auto a = d.ask(1, 100'000);
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);  // really, at once; on paper it takes half of the next second
  const auto b = d.ask(2, 60'000);
  d.now += seconds(1);
  const auto c = d.ask(3, 9'000);  // of b 10,000 are left
  EXPECT_EQ(d.serve_all(), (Keys{c, b}));
}

TEST(FspRule, ASessionThatLeavesTakesItsJobsAlong) {
  Driver d(fsp());
  d.ask(1, 100'000);
  const auto b = d.ask(2, 60'000);
  d.scheduler.remove_session(1, d.now);
  d.now += milliseconds(550);
  const auto c = d.ask(3, 6'000);  // of b 5,000 are left
  EXPECT_EQ(d.serve_all(), (Keys{b, c}));
}

}  // namespace
}  // namespace pmcd::scheduler
