// SPDX-License-Identifier: MIT
// Turns, one situation at a time: chunks, slots, interruption, parking, cancelling, want of memory, the end of the
// daemon.
#include "daemon/turns/turns.h"

#include <gtest/gtest.h>

#include "tests/turns/desk.h"

namespace pmcd::turns {
namespace {

using namespace std::chrono_literals;
using Key = scheduler::RequestKey;

/// A chunk to a client that was not measured, as its stream carries it.
constexpr std::uint64_t kChunk = 4'096 + Desk::kHead;

TEST(Turns, SendInChunksAndHoldTheSlotUntilTheLastByteIsAcknowledged) {
  Desk desk("fifo");
  const Key first = desk.ask(1, 10'000);
  const Key second = desk.ask(2, 5'000);
  EXPECT_EQ(desk.items[first].sent, 4'096U) << "one chunk is queued at a time";
  desk.write(1);
  EXPECT_EQ(desk.chunks, (std::vector<Key>{first, first, first}));
  EXPECT_TRUE(desk.items[first].ended);
  desk.wait(100ms);
  EXPECT_FALSE(desk.items[first].released) << "nothing is acknowledged";
  EXPECT_EQ(desk.items[second].sent, 0U);
  desk.acknowledge(1);
  desk.wait(25ms);
  EXPECT_TRUE(desk.items[first].released);
  EXPECT_EQ(desk.items[second].sent, 4'096U);
}

TEST(Turns, WhoAsksAgainIsLookedAtAtOnce) {
  Desk desk("fifo");
  const Key first = desk.ask(1, 1'000);
  desk.write(1);
  desk.acknowledge(1);
  desk.turns.heard(1);
  EXPECT_TRUE(desk.items[first].released);
}

TEST(Turns, AQuantumEndsATurnAtAChunkBoundaryAndItGoesOnThere) {
  Desk desk("fifo", 1, 50ms);
  const Key large = desk.ask(1, 40'000);
  const Key small = desk.ask(2, 3'000);
  desk.clock += 40ms;
  desk.write(1, kChunk);
  EXPECT_EQ(desk.items[large].sent, 8'192U) << "its turn is not over";
  desk.clock += 20ms;
  desk.write(1, kChunk);
  EXPECT_EQ(desk.items[large].interruptions, 1);
  EXPECT_EQ(desk.items[large].sent, 8'192U);
  EXPECT_EQ(desk.items[small].sent, 3'000U) << "the slot is another's";
  EXPECT_EQ(desk.turns.interruptions(), 1U);
  desk.serve(2);
  desk.serve(1);
  EXPECT_TRUE(desk.items[large].released);
  EXPECT_EQ(desk.turns.scheduler().waiting() + desk.turns.scheduler().running(), 0U);
}

TEST(Turns, WithNobodyElseAQuantumEndsNothing) {
  Desk desk("fifo", 1, 50ms);
  const Key alone = desk.ask(1, 40'000);
  desk.write_slowly(1, kChunk, 60ms, 10);
  EXPECT_EQ(desk.items[alone].interruptions, 0);
  EXPECT_TRUE(desk.items[alone].ended);
}

TEST(Turns, WhatMayNotBeInterruptedIsNot) {
  Desk desk("fifo", 1, 50ms);
  desk.lists.insert(1);
  const Key list = desk.ask(1, 40'000);
  desk.ask(2, 3'000);
  desk.write_slowly(1, kChunk, 60ms, 12);
  EXPECT_EQ(desk.items[list].interruptions, 0);
  EXPECT_TRUE(desk.items[list].ended);
}

TEST(Turns, WhoseSocketTakesNothingLosesItsTurnAndWaitsUntilItDoes) {
  Desk desk("fifo", 1, 50ms);
  const Key stuck = desk.ask(1, 40'000);
  const Key other = desk.ask(2, 3'000);
  desk.wait(100ms);
  EXPECT_EQ(desk.items[stuck].interruptions, 1);
  EXPECT_EQ(desk.items[other].sent, 3'000U);
  ASSERT_EQ(desk.turns.running().size(), 2U);
  EXPECT_TRUE(desk.turns.running().front().is_stopped);
  desk.serve(2);
  EXPECT_EQ(desk.items[stuck].sent, 4'096U) << "it is not asked again while its socket is full";
  desk.write(1, 5'000);
  EXPECT_GT(desk.items[stuck].sent, 4'096U);
}

/// Of a client that nothing is known of, little is sent ahead where others want the uplink, too.
TEST(Turns, AClientOfUnknownSpeedIsHeldBackParkedAndGoesOnWhenItAcknowledges) {
  Desk desk("fifo", std::nullopt, 50ms, 100'000);
  const Key unknown = desk.ask(1, 100'000);
  desk.write(1, 50'000);
  EXPECT_GT(desk.items[unknown].sent, 40'000U) << "alone it may have all";
  desk.ask(2, 100'000);
  const std::uint64_t before = desk.items[unknown].sent;
  desk.write(1);
  EXPECT_EQ(desk.items[unknown].sent, before) << "enough is under way";
  desk.wait(200ms);
  EXPECT_GE(desk.items[unknown].interruptions, 1) << "its turn ends though its socket has taken all";
  EXPECT_EQ(desk.items[unknown].sent, before);
  const auto running = desk.turns.running();
  const auto stopped =
      std::find_if(running.begin(), running.end(), [&](const auto& one) { return one.key == unknown; });
  ASSERT_NE(stopped, running.end());
  EXPECT_TRUE(stopped->is_stopped) << "parked: it would be the next again and again";
  desk.acknowledge(1);
  desk.wait(100ms);
  desk.write(1);
  EXPECT_GT(desk.items[unknown].sent, before);
}

TEST(Turns, CancelledWhileItWaitsReadsSendsOrIsStopped) {
  Desk desk("fifo", 1, 50ms);
  const Key sending = desk.ask(1, 40'000);
  const Key waiting = desk.ask(2, 40'000);
  desk.turns.cancel(waiting);
  EXPECT_TRUE(desk.items[waiting].cancelled && desk.items[waiting].released);

  const Key next = desk.ask(2, 3'000);
  desk.wait(100ms);
  desk.turns.cancel(sending);
  EXPECT_TRUE(desk.items[sending].cancelled && desk.items[sending].released) << "it is stopped, and holds no slot";
  desk.serve(2);
  EXPECT_TRUE(desk.items[next].released);

  const Key again = desk.ask(2, 40'000);
  desk.turns.cancel(again);
  EXPECT_TRUE(desk.items[again].cancelled);
  EXPECT_FALSE(desk.items[again].released) << "what was sent holds the slot";
  desk.turns.cancel(again);
  desk.serve(2);
  EXPECT_TRUE(desk.items[again].released);

  desk.slow_store = true;
  const Key reading = desk.ask(3, 40'000);
  EXPECT_EQ(desk.turns.scheduler().running(), 1U);
  desk.turns.cancel(reading);
  EXPECT_TRUE(desk.items[reading].cancelled && desk.items[reading].released);
  desk.turns.ready(reading, {40'000});
  EXPECT_EQ(desk.items[reading].sent, 0U);
  EXPECT_EQ(desk.turns.scheduler().running(), 0U);
}

TEST(Turns, WhatCannotBeReadFreesItsSlot) {
  Desk desk("fifo");
  desk.slow_store = true;
  const Key unreadable = desk.ask(1, 40'000);
  const Key readable = desk.ask(2, 3'000);
  desk.turns.fail(unreadable);
  EXPECT_TRUE(desk.items[unreadable].released);
  desk.run();
  desk.turns.ready(readable, {3'000});
  EXPECT_TRUE(desk.items[readable].ended);
}

TEST(Turns, WantOfMemoryEndsOneSessionAndNoOther) {
  Desk desk("fifo");
  desk.memory_is_out = true;
  const Key poor = desk.ask(1, 40'000);
  EXPECT_TRUE(desk.items[poor].gone);
  EXPECT_EQ(desk.turns.scheduler().running(), 0U);
  desk.memory_is_out = false;
  const Key other = desk.ask(2, 3'000);
  EXPECT_TRUE(desk.items[other].ended);
}

TEST(Turns, WhoTakesNothingForTenSecondsIsDropped) {
  Desk desk("fifo", 1, 50ms);
  desk.ask(1, 40'000);
  desk.wait(9s);
  EXPECT_TRUE(desk.dropped.empty());
  desk.wait(2s);
  EXPECT_EQ(desk.dropped.at(1), Pace::Verdict::stalled);
  EXPECT_FALSE(desk.turns.has_to_poll());
}

TEST(Turns, WhenTheDaemonEndsWhatRunsComesToItsEndAndNothingBegins) {
  Desk desk("fifo", 1, 50ms);
  const Key running = desk.ask(1, 40'000);
  const Key waiting = desk.ask(2, 3'000);
  desk.turns.drain();
  desk.write_slowly(1, kChunk, 60ms, 12);
  desk.serve(1);
  EXPECT_TRUE(desk.items[running].released);
  EXPECT_EQ(desk.items[running].interruptions, 0);
  EXPECT_EQ(desk.items[waiting].sent, 0U);
}

TEST(Turns, ASwitchOfTheRuleLetsRunWhatRuns) {
  Desk desk("fifo");
  const Key running = desk.ask(1, 40'000);
  const Key large = desk.ask(2, 30'000);
  const Key small = desk.ask(3, 3'000);
  desk.turns.switch_to(Desk::policy("spf", 1, std::nullopt, 0));
  desk.run();
  desk.serve(1);
  EXPECT_TRUE(desk.items[running].released);
  EXPECT_EQ(desk.items[small].sent, 3'000U);
  EXPECT_EQ(desk.items[large].sent, 0U);
}

}  // namespace
}  // namespace pmcd::turns
