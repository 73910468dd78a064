// SPDX-License-Identifier: MIT
// What is common to all rules, in virtual time: turns that are interrupted (quantum), requests that have waited long
// (aging), transfers beside each other (slots), and a policy that changes while requests wait and run.
#include <gtest/gtest.h>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

Policy with_quantum(std::string rule, Time quantum) {
  Policy policy = policy_of(std::move(rule));
  policy.quantum = quantum;
  return policy;
}

TEST(Quantum, CountsFromTheFirstChunkOfTheTurnAndOnlyIfOthersWait) {
  Driver d(with_quantum("fifo", milliseconds(100)));
  const auto a = d.ask(1, 1'000);
  ASSERT_EQ(d.take(), a);
  d.now += milliseconds(70);  // reading the packet, say
  d.scheduler.turn_begins(a, d.now);
  const auto b = d.ask(2, 1'000);
  EXPECT_FALSE(d.scheduler.quantum_is_over(a, d.now + milliseconds(99)));
  EXPECT_TRUE(d.scheduler.quantum_is_over(a, d.now + milliseconds(100)));
  EXPECT_FALSE(d.scheduler.quantum_is_over(b, d.now + milliseconds(500))) << "does not run";
  d.scheduler.park(b);
  EXPECT_FALSE(d.scheduler.quantum_is_over(a, d.now + milliseconds(500))) << "b cannot take anything";
  d.scheduler.unpark(b, d.now);
  EXPECT_TRUE(d.scheduler.quantum_is_over(a, d.now + milliseconds(500)));
  ASSERT_TRUE(d.scheduler.withdraw(b));
  EXPECT_FALSE(d.scheduler.quantum_is_over(a, d.now + milliseconds(500)));
}

TEST(Quantum, WithoutItNoTurnIsOver) {
  Driver d(policy_of("fifo"));
  const auto a = d.ask(1, 1'000);
  d.ask(2, 1'000);
  ASSERT_EQ(d.take(), a);
  EXPECT_FALSE(d.scheduler.quantum_is_over(a, d.now + seconds(1'000)));
}

TEST(Quantum, TurnsAlternateAndNoByteIsSentTwice) {
  Driver d(with_quantum("fifo", milliseconds(100)));
  const auto a = d.ask(1, 250);
  d.now += Time{1};
  const auto b = d.ask(2, 150);
  Keys turns;
  std::map<RequestKey, std::uint64_t> sent;
  while (auto turn = d.scheduler.take(d.now)) {  // one byte a millisecond, in chunks of 10
    turns.push_back(turn->key);
    d.scheduler.turn_begins(turn->key, d.now);
    std::uint64_t offset = turn->offset_bytes;
    ASSERT_EQ(offset, sent[turn->key]) << "goes on where it was interrupted";
    while (true) {
      d.now += milliseconds(10);
      offset += 10;
      if (offset == turn->size_bytes) {
        d.scheduler.complete(turn->key, d.now);
        break;
      }
      if (d.scheduler.quantum_is_over(turn->key, d.now) && !d.scheduler.yield(turn->key, offset, d.now)) break;
    }
    sent[turn->key] = offset;
  }
  EXPECT_EQ(turns, (Keys{a, b, a, b, a}));
  EXPECT_EQ(sent[a], 250U);
  EXPECT_EQ(sent[b], 150U);
}

TEST(Quantum, WhoIsNextAgainHoldsItsSlotForAnotherTurn) {
  Driver d(with_quantum("spf", milliseconds(100)));
  const auto small = d.ask(1, 100);
  const auto large = d.ask(2, 1'000);
  ASSERT_EQ(d.take(), small);
  d.now += milliseconds(100);
  ASSERT_TRUE(d.scheduler.quantum_is_over(small, d.now));
  EXPECT_TRUE(d.scheduler.yield(small, 50, d.now));
  EXPECT_TRUE(d.scheduler.is_running(small));
  EXPECT_EQ(d.scheduler.find(small)->offset_bytes, 50U);
  EXPECT_EQ(d.scheduler.find(small)->queued_at, d.now);
  EXPECT_EQ(d.scheduler.find(small)->asked_at, Time{0});
  EXPECT_FALSE(d.scheduler.quantum_is_over(small, d.now + milliseconds(99))) << "a new turn";
  EXPECT_TRUE(d.scheduler.quantum_is_over(small, d.now + milliseconds(100)));
  EXPECT_EQ(d.take(), 0U);
  d.scheduler.complete(small, d.now);
  EXPECT_EQ(d.take(), large);
}

/// Its speed of old would make a client that takes nothing the next again and again.
TEST(Quantum, WhoTakesNothingHasNoOtherTurn) {
  Driver d(with_quantum("fcsf", milliseconds(250)));
  d.measure(1, 1'000'000);
  const auto fast = d.ask(1, 1'000'000);
  const auto other = d.ask(2, 1'000'000'000);
  d.scheduler.observe(2, {d.now, 0, true, 0, Time{0}}, d.now);
  d.now += seconds(4);
  d.scheduler.observe(2, {d.now, 40'000, false, 0, Time{0}}, d.now);
  ASSERT_EQ(d.take(), fast);
  d.scheduler.turn_begins(fast, d.now);
  d.now += milliseconds(250);
  ASSERT_TRUE(d.scheduler.quantum_is_over(fast, d.now));
  EXPECT_TRUE(d.scheduler.yield(fast, 50'000, d.now)) << "what it was sent may still be on its way";
  d.now += milliseconds(250);
  ASSERT_TRUE(d.scheduler.quantum_is_over(fast, d.now));
  EXPECT_FALSE(d.scheduler.yield(fast, 100'000, d.now));
  d.scheduler.park(fast);
  EXPECT_EQ(d.take(), other);
}

TEST(Quantum, ASwitchSetsItForTurnsThatAreOn) {
  Driver d(policy_of("fifo"));
  const auto a = d.ask(1, 100);
  d.ask(2, 100);
  ASSERT_EQ(d.take(), a);
  d.now += seconds(1);
  d.scheduler.switch_to(with_quantum("fifo", milliseconds(100)), d.now);
  EXPECT_TRUE(d.scheduler.quantum_is_over(a, d.now));
}

Policy with_aging(std::string rule, Time aging) {
  Policy policy = policy_of(std::move(rule));
  policy.aging = aging;
  return policy;
}

TEST(Aging, OlderGoesBeforeAllThatAreNotAmongThemselvesOldestFirst) {
  Driver d(with_aging("spf", seconds(10)));
  const auto first = d.ask(1, 9'000);
  d.now += seconds(1);
  const auto second = d.ask(2, 8'000);
  d.now += seconds(9);
  const auto small = d.ask(3, 1);
  EXPECT_EQ(d.scheduler.ranking(9, d.now).front().key, small) << "10 s is not older than 10 s";
  d.now += seconds(2);
  const auto ranking = d.scheduler.ranking(9, d.now);
  ASSERT_EQ(ranking.size(), 3U);
  EXPECT_EQ(ranking.front().reason, "older than the policy's aging");
  EXPECT_EQ(d.serve_all(), (Keys{first, second, small}));
}

TEST(Aging, CountsFromAskedAtAlsoWhenItWentBack) {
  Driver d(with_aging("fifo", seconds(10)));
  const auto a = d.ask(1, 100);
  d.now += seconds(1);
  const auto b = d.ask(2, 100);
  ASSERT_EQ(d.take(), a);
  d.now += seconds(9) + milliseconds(500);
  ASSERT_TRUE(d.scheduler.requeue(a, 50, d.now));
  EXPECT_EQ(d.serve_all(), (Keys{a, b})) << "10.5 s since it was asked for";
}

TEST(Aging, AParkedOneIsPassedOverUntilItIsBack) {
  Driver d(with_aging("fifo", seconds(1)));
  const auto a = d.ask(1, 100);
  const auto b = d.ask(2, 100);
  d.now += seconds(5);
  d.scheduler.park(a);
  const auto c = d.ask(3, 100);
  ASSERT_EQ(d.take(), b);
  d.scheduler.complete(b, d.now);
  d.scheduler.unpark(a, d.now);
  EXPECT_EQ(d.serve_all(), (Keys{a, c}));
}

/// Who may be overtaken by nobody cannot be interrupted either: it is next again at once, however slow its client is.
TEST(Aging, TheOldestOfTheAgedKeepsItsSlotToItsEnd) {
  Policy policy = with_aging("fifo", seconds(1));
  policy.quantum = milliseconds(100);
  Driver d(policy);
  const auto old = d.ask(1, 1'000);
  d.now += milliseconds(1);
  const auto later = d.ask(2, 1'000);
  ASSERT_EQ(d.take(), old);
  d.now += milliseconds(100);
  ASSERT_TRUE(d.scheduler.quantum_is_over(old, d.now));
  EXPECT_FALSE(d.scheduler.yield(old, 10, d.now)) << "not aged yet";
  ASSERT_EQ(d.take(), later);
  d.now += seconds(1);
  ASSERT_TRUE(d.scheduler.quantum_is_over(later, d.now));
  EXPECT_FALSE(d.scheduler.yield(later, 10, d.now)) << "both are aged, and the other was asked for before it";
  ASSERT_EQ(d.take(), old);
  d.scheduler.observe(1, {d.now, 0, true, 0, Time{0}}, d.now);
  for (std::uint64_t offset = 20; offset < 100; offset += 10) {
    d.now += milliseconds(400);
    d.scheduler.observe(1, {d.now, offset, true, 0, Time{0}}, d.now);
    d.now += milliseconds(100);
    ASSERT_TRUE(d.scheduler.quantum_is_over(old, d.now));
    EXPECT_TRUE(d.scheduler.yield(old, offset, d.now)) << "its turn ends and begins anew";
  }
  EXPECT_EQ(d.take(), 0U) << "the other has no turn in all that time";
  d.now += seconds(1);
  EXPECT_FALSE(d.scheduler.yield(old, 100, d.now)) << "its client takes nothing any more";
  EXPECT_EQ(d.take(), old) << "unless it is parked";
  d.scheduler.complete(old, d.now);
  EXPECT_EQ(d.take(), later);
}

TEST(Slots, AutoStartsFurtherOnesWhileTheUplinkIsNotFull) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  for (SessionKey slow = 1; slow <= 5; ++slow) d.measure(slow, 30'000);
  for (SessionKey slow = 1; slow <= 5; ++slow) d.ask(slow, 1'000'000);
  EXPECT_NE(d.take(), 0U);
  EXPECT_NE(d.take(), 0U);
  EXPECT_NE(d.take(), 0U) << "two of them take 60 of 100 kB/s";
  EXPECT_EQ(d.take(), 0U) << "three take 90";
  EXPECT_EQ(d.scheduler.running(), 3U);
  EXPECT_TRUE(d.scheduler.frees_slot_when_written());
}

TEST(Slots, AutoWithAFastClientIsOne) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  d.measure(1, 500'000);
  const auto fast = d.ask(1, 1'000'000);
  d.ask(2, 1'000);
  EXPECT_EQ(d.take(), fast);
  EXPECT_EQ(d.take(), 0U);
}

TEST(Slots, AutoAnUnmeasuredClientThatTakesLittleLeavesRoomAsSoonAsItShows) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  const auto unknown = d.ask(1, 1'000'000);
  const auto other = d.ask(2, 1'000);
  ASSERT_EQ(d.take(), unknown);
  EXPECT_EQ(d.take(), 0U) << "may be as fast as the uplink";
  d.scheduler.observe(1, {d.now, 0, true, 0, Time{0}}, d.now);
  d.now += milliseconds(250);
  EXPECT_EQ(d.take(), 0U);
  d.scheduler.observe(1, {d.now, 1'000, true, 0, Time{0}}, d.now);
  EXPECT_EQ(d.take(), other) << "4 kB/s do not fill it";
}

TEST(Slots, AutoAClientThatTakesNothingLeavesRoomAfterHalfASecond) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  d.ask(1, 1'000'000);
  const auto other = d.ask(2, 1'000);
  ASSERT_NE(d.take(), 0U);
  d.scheduler.observe(1, {d.now, 0, true, 0, Time{0}}, d.now);
  d.now += milliseconds(499);
  EXPECT_EQ(d.take(), 0U);
  d.now += milliseconds(1);
  EXPECT_EQ(d.take(), other);
}

/// With another turn of the same client the half second does not begin anew.
TEST(Slots, AutoAClientThatTakesLittleLeavesRoomInItsSecondTurnToo) {
  Policy policy = policy_of("srpt", {}, std::nullopt);
  policy.uplink = 100'000;
  policy.quantum = milliseconds(400);
  Driver d(policy);
  d.measure(1, 90'000);
  const auto fast = d.ask(1, 1'000'000);
  d.measure(2, 10'000);
  const auto slow = d.ask(2, 10'000'000);
  ASSERT_EQ(d.take(), fast);
  d.scheduler.turn_begins(fast, d.now);
  EXPECT_EQ(d.take(), 0U);
  d.scheduler.observe(1, {d.now, 1'800'000, true, 0, Time{0}}, d.now);
  for (std::uint64_t n = 1; n <= 8; ++n) {
    d.now += milliseconds(50);
    d.scheduler.observe(1, {d.now, 1'800'000 + 1'000 * n, true, 0, Time{0}}, d.now);
  }
  ASSERT_TRUE(d.scheduler.yield(fast, 100'000, d.now));
  EXPECT_EQ(d.take(), 0U);
  d.now += milliseconds(100);
  EXPECT_EQ(d.take(), slow);
}

/// Several that share a full uplink are seen to take less of it than one alone: were a sixth of it taken for room,
/// more and more would share it.
TEST(Slots, AutoIsFullWhenThreeQuartersOfTheUplinkAreTaken) {
  for (const std::uint64_t taken : {74U, 76U}) {
    Policy policy = policy_of("fifo", {}, std::nullopt);
    policy.uplink = 100'000;
    Driver d(policy);
    for (const SessionKey slow : {1U, 2U, 3U}) d.measure(slow, 20'000);
    const auto first = d.ask(1, 1'000'000);
    const auto second = d.ask(2, 1'000'000);
    const auto third = d.ask(4, 1'000'000);
    ASSERT_EQ(d.take(), first);
    ASSERT_EQ(d.take(), second);
    d.scheduler.observe(3, {d.now, 0, true, 0, Time{0}}, d.now);
    for (std::uint64_t n = 1; n <= 12; ++n) {
      d.now += milliseconds(50);
      d.scheduler.observe(3, {d.now, 400'000 + taken * 50 * n, true, 0, Time{0}}, d.now);
    }
    EXPECT_EQ(d.take(), taken < 75 ? third : 0U);
  }
}

/// A fast client is through, and what it took of late is no reason to leave the uplink to a slow one alone.
TEST(Slots, AutoWhatOthersTookDoesNotKeepASlowClientAlone) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  d.measure(1, 10'000);
  d.measure(2, 90'000);
  const auto fast = d.ask(2, 1'000'000);
  ASSERT_EQ(d.take(), fast);
  const auto slow = d.ask(1, 1'000'000);
  const auto other = d.ask(3, 1'000'000);
  d.scheduler.observe(2, {d.now, 1'800'000, true, 0, Time{0}}, d.now);
  for (std::uint64_t n = 1; n <= 12; ++n) {
    d.now += milliseconds(50);
    d.scheduler.observe(2, {d.now, 1'800'000 + 4'500 * n, true, 0, Time{0}}, d.now);
  }
  EXPECT_EQ(d.take(), 0U);
  d.scheduler.complete(fast, d.now);
  EXPECT_EQ(d.take(), slow);
  EXPECT_EQ(d.take(), other);
}

TEST(Slots, OthersAreThoseThatRunOrMayHaveASlot) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  d.ask(1, 1'000);
  ASSERT_NE(d.take(), 0U);
  d.ask(1, 1'000);
  EXPECT_FALSE(d.scheduler.has_others(1)) << "its own that is held";
  const auto other = d.ask(2, 1'000);
  EXPECT_TRUE(d.scheduler.has_others(1)) << "waits";
  EXPECT_TRUE(d.scheduler.has_others(2)) << "runs";
  d.scheduler.park(other);
  EXPECT_FALSE(d.scheduler.has_others(1)) << "cannot take anything now";
}

/// Two that share the uplink show half of it each; the first of them alone may have it all.
TEST(Slots, AutoAClientThatTookAGoodPartOfTheUplinkMayFillIt) {
  for (const std::uint64_t speed : {35'000U, 45'000U}) {
    Policy policy = policy_of("fifo", {}, std::nullopt);
    policy.uplink = 100'000;
    Driver d(policy);
    d.measure(1, speed);
    const auto first = d.ask(1, 1'000'000);
    const auto second = d.ask(2, 1'000'000);
    ASSERT_EQ(d.take(), first);
    EXPECT_EQ(d.take(), speed < 40'000 ? second : 0U);
  }
}

/// One channel carries one transfer at a time: a client's second request waits for its first, and others go.
TEST(Slots, AutoNoClientHasTwo) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  Driver d(policy);
  d.measure(1, 10'000);
  d.measure(2, 10'000);
  const auto first = d.ask(1, 1'000);
  const auto second = d.ask(1, 2'000);
  const auto other = d.ask(2, 3'000);
  ASSERT_EQ(d.take(), first);
  EXPECT_TRUE(d.scheduler.is_held(second));
  EXPECT_EQ(d.take(), other);
  EXPECT_EQ(d.take(), 0U);
  d.scheduler.complete(first, d.now);
  EXPECT_FALSE(d.scheduler.is_held(second));
  EXPECT_EQ(d.take(), second);
}

/// Two that each could fill the uplink came to share it, because little was known of them: at the end of a quantum one
/// goes back although nobody waits, and the rule says which goes on.
TEST(Slots, AutoWhoShareAFullUplinkTakeTurns) {
  Policy policy = policy_of("fifo", {}, std::nullopt);
  policy.uplink = 100'000;
  policy.quantum = milliseconds(500);
  Driver d(policy);
  const auto first = d.ask(1, 1'000'000);
  const auto second = d.ask(2, 1'000'000);
  ASSERT_EQ(d.take(), first);
  d.scheduler.observe(1, {d.now, 0, true, 0, Time{0}}, d.now);
  d.now += milliseconds(100);
  d.scheduler.observe(1, {d.now, 500, true, 0, Time{0}}, d.now);
  ASSERT_EQ(d.take(), second) << "5 kB/s would leave room";
  d.scheduler.observe(2, {d.now, 0, true, 0, Time{0}}, d.now);
  EXPECT_FALSE(d.scheduler.quantum_is_over(first, d.now + seconds(9))) << "nobody waits, and the uplink is not full";
  for (std::uint64_t n = 1; n <= 14; ++n) {
    d.now += milliseconds(50);
    for (const SessionKey session : {SessionKey{1}, SessionKey{2}}) {
      d.scheduler.observe(session, {d.now, 500 + 2'500 * n, true, 0, Time{0}}, d.now);
    }
  }
  ASSERT_TRUE(d.scheduler.quantum_is_over(first, d.now));
  EXPECT_FALSE(d.scheduler.yield(first, 35'500, d.now)) << "the other may fill it alone";
  EXPECT_EQ(d.take(), 0U);
  ASSERT_TRUE(d.scheduler.quantum_is_over(second, d.now));
  EXPECT_FALSE(d.scheduler.yield(second, 35'500, d.now)) << "the first waits longer";
  EXPECT_EQ(d.take(), first);
}

TEST(Slots, AutoMeasuresTheUplinkItself) {
  Driver d(policy_of("fifo", {}, std::nullopt));
  for (SessionKey session = 1; session <= 9; ++session) d.ask(session, 1'000'000);
  Keys running;
  while (const RequestKey key = d.take()) running.push_back(key);
  EXPECT_EQ(running.size(), 4U) << "nothing is known of it";
  EXPECT_EQ(d.scheduler.uplink(), 0);
  for (int n = 0; n < 20; ++n) {
    d.now += milliseconds(100);
    for (SessionKey session = 1; session <= 4; ++session) {
      d.scheduler.observe(session, {d.now, static_cast<std::uint64_t>(2'500 * n), true, 0, Time{0}}, d.now);
      d.scheduler.acknowledged(session, 2'500, d.now);
    }
  }
  EXPECT_EQ(d.scheduler.uplink(), 100'000);
  // Four take all that was ever seen of it, and whether there is more only trying tells: 1.0 < 0.85 x 1.25.
  EXPECT_NE(d.take(), 0U);
}

TEST(Slots, ANumberIsANumberAndWhatTheCallerHoldsCounts) {
  Driver d(policy_of("fifo", {}, 3));
  for (SessionKey session = 1; session <= 9; ++session) d.ask(session, 10);
  EXPECT_NE(d.take(), 0U);
  EXPECT_TRUE(d.scheduler.has_slot(d.now, 1));
  EXPECT_FALSE(d.scheduler.has_slot(d.now, 2));
  EXPECT_FALSE(d.scheduler.take(d.now, 2));
  EXPECT_NE(d.take(), 0U);
  EXPECT_NE(d.take(), 0U);
  EXPECT_EQ(d.take(), 0U);
  EXPECT_FALSE(d.scheduler.frees_slot_when_written());
}

TEST(Switch, WaitingOnesAreReorderedRunningOnesGoOn) {
  for (const RuleEntry& rule : all_rules()) {
    Driver d(policy_of("fifo"));
    const auto running = d.ask(9, 100);
    d.now += Time{1};
    const auto large = d.ask(1, 900);
    const auto parked = d.ask(3, 1);
    const auto small = d.ask(2, 100);
    ASSERT_EQ(d.take(), running);
    d.scheduler.park(parked);
    d.scheduler.switch_to(policy_of(std::string(rule.name)), d.now);
    EXPECT_TRUE(d.scheduler.is_running(running));
    EXPECT_EQ(d.scheduler.policy().rule, rule.name);
    EXPECT_EQ(d.take(), 0U) << "its slot is still taken";
    ASSERT_EQ(d.scheduler.ranking(9, d.now).size(), 2U);
    d.scheduler.switch_to(policy_of("spf"), d.now);
    d.scheduler.complete(running, d.now);
    ASSERT_EQ(d.take(), small) << rule.name;
    d.scheduler.complete(small, d.now);
    d.scheduler.unpark(parked, d.now);
    EXPECT_EQ(d.serve_all(), (Keys{parked, large}));
  }
}

TEST(Switch, FewerSlotsTakeEffectAsTransfersEnd) {
  Driver d(policy_of("fifo", {}, 3));
  Keys keys;
  for (SessionKey session = 1; session <= 5; ++session) keys.push_back(d.ask(session, 10));
  for (int n = 0; n < 3; ++n) ASSERT_NE(d.take(), 0U);
  d.scheduler.switch_to(policy_of("fifo", {}, 1), d.now);
  EXPECT_EQ(d.scheduler.running(), 3U);
  d.scheduler.complete(keys[0], d.now);
  d.scheduler.complete(keys[1], d.now);
  EXPECT_EQ(d.take(), 0U);
  d.scheduler.complete(keys[2], d.now);
  EXPECT_EQ(d.take(), keys[3]);
}

}  // namespace
}  // namespace pmcd::scheduler
