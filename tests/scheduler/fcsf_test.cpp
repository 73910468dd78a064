// SPDX-License-Identifier: MIT
// Fastest connection speed first, and each clause of its burst: who counts as fast, what has to wait already, and that
// it happens once, also where there are several slots or turns are interrupted.
#include <gtest/gtest.h>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

Policy burst(std::size_t slots = 1) {
  return policy_of("fcsf", {{"burst", "2"}}, slots);
}

TEST(FcsfRule, ShortestExpectedTime) {
  Driver d(policy_of("fcsf"));
  d.measure(1, 10'000);
  d.measure(2, 100'000);
  const auto slow = d.ask(1, 5'000, 9'000'000);  // 0.5 s; the rest of the mesh does not matter
  const auto fast = d.ask(2, 60'000);            // 0.6 s
  const auto small = d.ask(2, 1'000);            // 0.01 s
  EXPECT_EQ(d.serve_all(), (Keys{small, slow, fast}));
}

TEST(FcsfRule, NotYetMeasuredIsTimeZero) {
  Driver d(policy_of("fcsf"));
  d.measure(1, 1'000'000);
  const auto measured = d.ask(1, 1);
  const auto unknown = d.ask(2, 10'000'000);
  const auto unknown_too = d.ask(3, 10);
  EXPECT_EQ(d.serve_all(), (Keys{unknown, unknown_too, measured})) << "both 0, so the older one, not the smaller";
}

TEST(FcsfRule, OnlyWhatIsStillToSendCounts) {
  Driver d(policy_of("fcsf"));
  d.measure(1, 10'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  ASSERT_EQ(d.take(), a);
  const auto b = d.ask(2, 500);
  ASSERT_TRUE(d.scheduler.requeue(a, 501, d.now));
  EXPECT_EQ(d.serve_all(), (Keys{a, b}));
}

TEST(FcsfRule, NewSpeedMovesWhatWaits) {
  Driver d(policy_of("fcsf"));
  d.measure(2, 20'000);
  const auto a = d.ask(1, 10'000);
  const auto b = d.ask(2, 10'000);
  EXPECT_EQ(d.scheduler.ranking(9, d.now).front().key, a);
  d.measure(1, 10'000);
  EXPECT_EQ(d.serve_all(), (Keys{b, a}));
}

TEST(FcsfRule, TiesByQueuedAtThenSession) {
  Driver d(policy_of("fcsf"));
  for (const SessionKey session : {1U, 4U, 9U}) d.measure(session, 10'000);
  const auto nine = d.ask(9, 10);
  const auto four = d.ask(4, 10);
  d.now += Time{1};
  const auto one = d.ask(1, 10);
  EXPECT_EQ(d.serve_all(), (Keys{four, nine, one}));
}

TEST(FcsfBurst, WithoutItTheLongPacketWaits) {
  Driver d(policy_of("fcsf"));
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto a2 = d.ask(1, 900'000);
  const auto b = d.ask(2, 10'000);
  EXPECT_EQ(d.serve_all(), (Keys{a, b, a2}));
}

TEST(FcsfBurst, SecondPacketOfAFastSessionOnce) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);     // 0.01 s
  const auto a2 = d.ask(1, 900'000);  // 9 s, the second of the burst
  const auto a3 = d.ask(1, 950'000);  // 9.5 s, no third
  const auto b = d.ask(2, 10'000);    // 1 s
  const auto b2 = d.ask(2, 20'000);   // 2 s; 2 is slow: no burst
  EXPECT_EQ(d.serve_all(), (Keys{a, a2, b, b2, a3}));
}

TEST(FcsfBurst, SlowSessionHasNone) {
  Driver d(burst());
  d.measure(1, 10'000);
  d.measure(2, 100'000);
  d.measure(3, 100'000);
  const auto a = d.ask(1, 10);       // 1 ms
  const auto a2 = d.ask(1, 90'000);  // 9 s
  const auto b = d.ask(2, 100'000);  // 1 s
  const auto c = d.ask(3, 200'000);  // 2 s
  EXPECT_EQ(d.serve_all(), (Keys{a, b, c, a2}));
}

TEST(FcsfBurst, MedianIsOfThoseThatWaitOrRun) {
  Driver d(burst());
  d.measure(1, 50'000);
  d.measure(2, 10'000);
  // Faster, but they ask for nothing.
  for (const SessionKey session : {5U, 6U, 7U, 8U}) d.measure(session, 900'000);
  const auto a = d.ask(1, 100);
  const auto a2 = d.ask(1, 500'000);  // 10 s
  const auto b = d.ask(2, 10'000);    // 1 s
  EXPECT_EQ(d.serve_all(), (Keys{a, a2, b}));
}

TEST(FcsfBurst, UnmeasuredSessionHasNone) {
  Driver d(burst());
  d.measure(2, 10'000);
  const auto a = d.ask(1, 100);
  d.now += Time{1};
  const auto c = d.ask(3, 100);
  d.now += Time{1};
  const auto a2 = d.ask(1, 100);
  EXPECT_EQ(d.serve_all(), (Keys{a, c, a2}));
}

TEST(FcsfBurst, OnlyWhatAlreadyWaits) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto b = d.ask(2, 10'000);
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  const auto a2 = d.ask(1, 900'000);
  EXPECT_EQ(d.serve_all(), (Keys{b, a2}));
}

TEST(FcsfBurst, NoneAfterAnInterruptedOrFailedPacket) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 90'000);    // 0.9 s
  const auto a2 = d.ask(1, 900'000);  // 9 s
  const auto b = d.ask(2, 9'500);     // 0.95 s
  ASSERT_EQ(d.take(), a);
  ASSERT_TRUE(d.scheduler.fail(a, 0, d.now));
  EXPECT_EQ(d.serve_all(), (Keys{b, a2}));
}

TEST(FcsfBurst, AfterTheSecondABurstMayBeginAnew) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const Keys a = {d.ask(1, 1'000), d.ask(1, 200'000), d.ask(1, 300'000), d.ask(1, 800'000)};
  const auto b = d.ask(2, 50'000);  // 5 s
  EXPECT_EQ(d.serve_all(), (Keys{a[0], a[1], a[2], a[3], b})) << "0.01, then 2 in a burst; 3, then 8 in a burst; 5";
}

TEST(FcsfBurst, WithdrawnSecondLeavesNothingBehind) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto a2 = d.ask(1, 800'000);
  d.ask(1, 900'000);
  const auto b = d.ask(2, 10'000);
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  ASSERT_EQ(d.scheduler.ranking(9, d.now).front().key, a2);
  ASSERT_TRUE(d.scheduler.withdraw(a2));
  EXPECT_EQ(d.take(), b);
}

TEST(FcsfBurst, OnceAlsoBesideOtherSlots) {
  Driver d(burst(2));
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);     // 0.01 s
  const auto a2 = d.ask(1, 800'000);  // 8 s
  const auto a3 = d.ask(1, 900'000);  // 9 s
  const Keys b = {d.ask(2, 1'000), d.ask(2, 2'000), d.ask(2, 3'000)};
  ASSERT_EQ(d.take(), a);
  ASSERT_EQ(d.take(), b[0]);
  d.scheduler.complete(a, d.now);
  ASSERT_EQ(d.take(), a2) << "the slot takes the session's next request";
  d.scheduler.complete(b[0], d.now);
  ASSERT_EQ(d.take(), b[1]) << "starts while the second of the burst runs";
  d.scheduler.complete(a2, d.now);
  EXPECT_EQ(d.take(), b[2]) << "no third packet, key " << a3;
}

TEST(FcsfBurst, TwoSlotsFreedAtOnceHaveABurstEach) {
  Driver d(burst(2));
  d.measure(1, 100'000);
  d.measure(2, 100'000);
  d.measure(3, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto b = d.ask(2, 1'000);
  const auto a2 = d.ask(1, 800'000);
  const auto b2 = d.ask(2, 900'000);
  d.ask(3, 10'000);
  ASSERT_EQ(d.take(), a);
  ASSERT_EQ(d.take(), b);
  d.scheduler.complete(b, d.now);
  d.scheduler.complete(a, d.now);
  EXPECT_EQ(d.scheduler.ranking(2, d.now).front().key, b2);
  EXPECT_EQ(d.take(), b2) << "the slot that came free first";
  EXPECT_EQ(d.take(), a2);
}

TEST(FcsfBurst, AnInterruptedSecondStaysTheSecond) {
  Policy policy = burst();
  policy.quantum = milliseconds(1);
  Driver d(policy);
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto a2 = d.ask(1, 800'000);  // 8 s
  const auto a3 = d.ask(1, 900'000);  // 9 s
  const auto b = d.ask(2, 10'000);    // 1 s
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  ASSERT_EQ(d.take(), a2);
  d.now += milliseconds(2);
  EXPECT_FALSE(d.scheduler.yield(a2, 790'000, d.now) && d.take() != 0);
  const auto again = d.scheduler.is_running(a2) ? a2 : d.take();
  ASSERT_EQ(again, a2) << "0.1 s are left of it";
  d.scheduler.complete(a2, d.now);
  EXPECT_EQ(d.serve_all(), (Keys{b, a3})) << "its burst is over";
}

/// Whoever enqueues never reuses a key; here one comes again, because that shows what the rule remembers of it.
TEST(FcsfBurst, AnInterruptedSecondThatIsWithdrawnIsForgotten) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto a2 = d.ask(1, 800'000);
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  ASSERT_EQ(d.take(), a2);
  ASSERT_TRUE(d.scheduler.requeue(a2, 1'000, d.now));
  const Request again = {a2, 1, 1, 0, 1'000, 0, 0, nullptr, d.now, d.now};
  ASSERT_TRUE(d.scheduler.withdraw(a2));
  ASSERT_TRUE(d.scheduler.enqueue(again, d.now));
  const auto a3 = d.ask(1, 900'000);  // 9 s
  const auto b = d.ask(2, 10'000);    // 1 s
  EXPECT_EQ(d.serve_all(), (Keys{a2, a3, b})) << "the first of a burst of its own";
}

TEST(FcsfBurst, ASecondStaysOneThroughASwitch) {
  Driver d(burst());
  d.measure(1, 100'000);
  d.measure(2, 10'000);
  const auto a = d.ask(1, 1'000);
  const auto a2 = d.ask(1, 800'000);
  const auto a3 = d.ask(1, 900'000);  // 9 s
  const auto b = d.ask(2, 10'000);    // 1 s
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  ASSERT_EQ(d.take(), a2);
  Policy policy = burst();
  policy.quantum = milliseconds(500);
  d.scheduler.switch_to(policy, d.now);
  d.scheduler.complete(a2, d.now);
  EXPECT_EQ(d.serve_all(), (Keys{b, a3})) << "its burst is over";
}

}  // namespace
}  // namespace pmcd::scheduler
