// SPDX-License-Identifier: MIT
// Deficit round robin over bytes: rounds worked out by hand, and the long run, in which bytes must be as the weights
// say whatever the packets' sizes, whether a client asks ahead or one packet at a time, and when turns are interrupted.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <deque>
#include <random>

#include "daemon/scheduler/rules/fair.h"
#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

TEST(FairRule, WhoseCreditIsEnoughInTheLeastRound) {
  Driver d(policy_of("fair"));
  const auto ten = d.ask(1, 15'000);      // round 10
  const auto two = d.ask(2, 3'000);       // round 2
  const auto three = d.ask(3, 3'001);     // round 3
  const auto also_two = d.ask(4, 1'501);  // round 2, by session behind 2
  EXPECT_EQ(d.serve_all(), (Keys{two, also_two, three, ten}));
}

TEST(FairRule, WeightMultipliesTheCredit) {
  Driver d(policy_of("fair"));
  d.scheduler.set_weight(1, 5, d.now);
  const auto a = d.ask(1, 15'000);  // round 2
  const auto b = d.ask(2, 4'500);   // round 3
  EXPECT_EQ(d.serve_all(), (Keys{a, b}));
}

TEST(FairRule, NewWeightMovesWhatWaits) {
  Driver d(policy_of("fair"));
  const auto a = d.ask(1, 15'000);
  const auto b = d.ask(2, 4'500);
  ASSERT_EQ(d.scheduler.ranking(1, d.now).front().key, b);
  d.scheduler.set_weight(1, 10, d.now);
  EXPECT_EQ(d.serve_all(), (Keys{a, b}));
}

TEST(FairRule, CreditThatIsLeftOverCountsInTheNextRound) {
  Driver d(policy_of("fair"));
  const auto a = d.ask(1, 1'600);  // round 2, 1,400 left
  const auto a2 = d.ask(1, 1'400);
  const auto b = d.ask(2, 3'000);  // round 2
  const auto b2 = d.ask(2, 1'400);
  EXPECT_EQ(d.serve_all(), (Keys{a, a2, b, b2}));
}

TEST(FairRule, NewcomersBeginInTheRoundThatIsOn) {
  // The second, smaller request of a session must not hold the round back that its first has earned.
  Driver d(policy_of("fair"));
  const auto a = d.ask(1, 3'000);  // round 2
  const auto a2 = d.ask(1, 100);
  const auto b = d.ask(2, 6'000);  // round 4
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  d.now += Time{1};
  const auto c = d.ask(3, 2'800);  // round 2 + 2
  EXPECT_EQ(d.serve_all(), (Keys{a2, b, c}));
}

TEST(FairRule, WhatAnInterruptedTurnDidNotSendIsGivenBack) {
  Driver d(policy_of("fair"));
  const auto a = d.ask(1, 3'000);  // round 2
  ASSERT_EQ(d.take(), a);
  d.now += Time{1};
  const auto b = d.ask(2, 1'500);  // round 3
  ASSERT_TRUE(d.scheduler.requeue(a, 1'000, d.now));
  EXPECT_EQ(d.take(), a) << "has paid for its 2,000 bytes already";
  d.scheduler.complete(a, d.now);
  EXPECT_EQ(d.take(), b);
}

TEST(FairRule, AFailedTransferCostsNothing) {
  Driver d(policy_of("fair"));
  const auto a = d.ask(1, 3'000);
  ASSERT_EQ(d.take(), a);
  ASSERT_TRUE(d.scheduler.fail(a, 0, d.now));
  const auto b = d.ask(2, 1'500);  // round 3
  d.now += Time{1};
  const auto again = d.ask(1, 3'000);
  EXPECT_EQ(d.serve_all(), (Keys{again, b}));
}

TEST(FairRule, WhoWentBeforeItsTimeOwes) {
  Policy policy = policy_of("fair");
  policy.aging = seconds(1);
  Driver d(policy);
  const auto aged = d.ask(1, 150'000);  // round 100
  d.now += seconds(2);
  Keys others;
  for (SessionKey session = 2; session < 6; ++session) others.push_back(d.ask(session, 15'000));  // round 10
  for (SessionKey session = 2; session < 6; ++session) others.push_back(d.ask(session, 15'000));  // round 20
  ASSERT_EQ(d.take(), aged);
  d.scheduler.complete(aged, d.now);
  const auto next = d.ask(1, 1'500);
  others.push_back(next);
  EXPECT_EQ(d.serve_all(), others) << "100 rounds ahead of its share, it is behind those of round 20";
}

TEST(FairRule, CreditIsNotSavedUpByAskingForNothing) {
  Driver d(policy_of("fair"));
  const auto hello = d.ask(1, 1'500);
  ASSERT_EQ(d.take(), hello);
  d.scheduler.complete(hello, d.now);
  const auto busy = d.ask(2, 1'500'000);  // a thousand rounds pass
  ASSERT_EQ(d.take(), busy);
  d.scheduler.complete(busy, d.now);
  const auto back = d.ask(1, 15'000);
  const auto other = d.ask(3, 3'000);
  EXPECT_EQ(d.serve_all(), (Keys{other, back}));
}

struct Share {
  double weight = 1;
  std::vector<std::uint64_t> sizes;  ///< of its packets, over and over
  std::size_t ahead = 1;             ///< requests that it has outstanding
  std::size_t asked = 0;
  double bytes = 0;
};

/// Serves `total` bytes; of a hundred turns so many are interrupted halfway.
void run(Driver& d, std::vector<Share>& shares, double total, int interrupted) {
  std::mt19937 random(7);
  const auto ask = [&](std::size_t s) {
    Share& share = shares[s];
    d.ask(s, share.sizes[share.asked++ % share.sizes.size()]);
  };
  for (std::size_t s = 0; s < shares.size(); ++s) {
    d.scheduler.set_weight(s, shares[s].weight, d.now);
    for (std::size_t n = 0; n < shares[s].ahead; ++n) ask(s);
  }
  for (double sent = 0; sent < total;) {
    d.now += Time{1};
    const auto taken = d.scheduler.take(d.now);
    ASSERT_TRUE(taken);
    std::uint64_t bytes = taken->remaining_bytes();
    const bool half = bytes > 1 && static_cast<int>(random() % 100) < interrupted;
    if (half) bytes /= 2;
    shares[taken->session].bytes += static_cast<double>(bytes);
    sent += static_cast<double>(bytes);
    if (half) {
      ASSERT_TRUE(d.scheduler.requeue(taken->key, taken->offset_bytes + bytes, d.now));
    } else {
      ASSERT_TRUE(d.scheduler.complete(taken->key, d.now));
      ask(taken->session);
    }
  }
}

void expect_proportional(const std::vector<Share>& shares, double within) {
  double weights = 0;
  double bytes = 0;
  for (const Share& share : shares) {
    weights += share.weight;
    bytes += share.bytes;
  }
  for (std::size_t s = 0; s < shares.size(); ++s) {
    const double due = bytes * shares[s].weight / weights;
    EXPECT_NEAR(shares[s].bytes, due, within * due) << "session " << s;
  }
}

std::vector<Share> mixed(std::size_t ahead) {
  return {{1, {60'000}, ahead},      {2, {400, 9'000, 1'500}, ahead},    {5, {1'500}, ahead},       {1, {400}, ahead},
          {2, {60'000, 100}, ahead}, {5, {30'000, 2'000, 7'777}, ahead}, {1, {1'499, 1'501}, ahead}};
}

TEST(FairLongRun, BytesAreAsTheWeightsWhenClientsAskAhead) {
  Driver d(policy_of("fair"));
  auto shares = mixed(3);
  run(d, shares, 6e7, 0);
  expect_proportional(shares, 0.03);
}

TEST(FairLongRun, AndWhenTheyAskForOnePacketAtATime) {
  Driver d(policy_of("fair"));
  auto shares = mixed(1);
  run(d, shares, 6e7, 0);
  expect_proportional(shares, 0.03);
}

TEST(FairLongRun, AndWhenTurnsAreInterrupted) {
  for (const std::size_t ahead : {1U, 2U}) {
    Driver d(policy_of("fair"));
    auto shares = mixed(ahead);
    run(d, shares, 6e7, 60);
    expect_proportional(shares, 0.03);
  }
}

TEST(FairLongRun, NoClientStarvesAmongRandomOnes) {
  EXPECT_TRUE(rc::check("each has its share, but for a packet and a round", [] {
    const auto count = *rc::gen::inRange<std::size_t>(2, 12);
    std::vector<Share> shares(count);
    double weights = 0;
    for (Share& share : shares) {
      share.weight = *rc::gen::element(0.5, 1.0, 2.0, 5.0, 20.0);
      share.ahead = *rc::gen::inRange<std::size_t>(1, 4);
      share.sizes = *rc::gen::nonEmpty(
          rc::gen::container<std::vector<std::uint64_t>>(rc::gen::inRange<std::uint64_t>(300, 60'000)));
      weights += share.weight;
    }
    Driver d(policy_of("fair"));
    run(d, shares, 2e6, *rc::gen::element(0, 30));
    double bytes = 0;
    for (const Share& share : shares) bytes += share.bytes;
    // DRR's bound: in whole rounds each has its credit within one packet; the rounds themselves differ by one.
    for (const Share& share : shares) {
      const double due = bytes * share.weight / weights;
      const double rounds_of_a_packet = 2 * (60'000 + kFairCredit * share.weight);
      RC_ASSERT(share.bytes >= due - rounds_of_a_packet - share.weight / weights * 60'000 * static_cast<double>(count));
    }
  }));
}

}  // namespace
}  // namespace pmcd::scheduler
