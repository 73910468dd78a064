// SPDX-License-Identifier: MIT
// Any sequence of requests, cancels, departures, switches, and of what sockets and clients take: each request's chunks
// follow each other and it ends once (the desk checks that), and when all take what they are sent, nothing is left.
#include <gtest/gtest.h>

#include <array>
#include <random>

#include "daemon/scheduler/registry.h"
#include "tests/turns/desk.h"

namespace pmcd::turns {
namespace {

using namespace std::chrono_literals;
using Key = scheduler::RequestKey;

class AnySequence : public ::testing::TestWithParam<std::uint32_t> {
 protected:
  std::uint64_t below(std::uint64_t bound) { return random_() % bound; }
  scheduler::Policy any_policy() {
    static constexpr std::array kRules{"fifo", "lcfs", "spf", "fcsf", "srpt", "fsp", "gain", "fair"};
    const auto slots = below(2) == 0 ? std::nullopt : std::optional<std::size_t>(1 + below(3));
    const auto quantum = below(3) == 0 ? std::nullopt : std::optional<Time>(1ms + below(200) * 1ms);
    scheduler::Policy policy =
        Desk::policy(kRules[below(kRules.size())], slots, quantum, static_cast<double>(below(2)) * 50'000.0);
    if (below(3) == 0) policy.aging = 1s;
    return policy;
  }

  std::mt19937 random_{GetParam()};
};

TEST_P(AnySequence, LosesNothingAndSendsNothingTwice) {
  Desk desk("fifo", 1, 50ms);
  std::size_t interrupted = 0;
  for (int step = 0; step < 3'000; ++step) {
    const scheduler::SessionKey session = 1 + below(6);
    const bool is_served = desk.streams.contains(session);
    const Key key = desk.items.empty() ? 1 : 1 + below(desk.items.size());
    switch (below(12)) {
      case 0:
      case 1:
        if (desk.turns.scheduler().counts(session).first < 4) desk.ask(session, 1 + below(60'000));
        break;
      case 2:
        desk.turns.cancel(key);
        break;
      case 3:
        if (below(20) == 0) desk.leave(session);
        break;
      case 4:
        if (below(5) == 0) desk.turns.switch_to(any_policy());
        break;
      case 5:
        desk.slow_store = below(4) == 0;
        break;
      case 6:
        if (below(4) == 0) {
          desk.turns.fail(key);
        } else if (desk.items.contains(key)) {
          desk.turns.ready(key, desk.content(key));
        }
        break;
      case 7:
        if (is_served) desk.acknowledge(session);
        desk.turns.heard(session);
        break;
      case 8:
        desk.wait(below(40) * 1ms);
        break;
      case 9:
        desk.clock += below(100) * 1ms;
        break;
      default:
        if (is_served) desk.write(session, below(20'000));
        if (is_served && below(2) == 0) desk.acknowledge(session);
    }
    desk.run();
    ASSERT_FALSE(::testing::Test::HasFailure()) << "step " << step;
  }
  desk.slow_store = false;
  for (int round = 0; round < 200 && desk.turns.scheduler().waiting() + desk.turns.scheduler().running() > 0; ++round) {
    for (const auto& running : desk.turns.running()) desk.turns.ready(running.key, desk.content(running.key));
    for (scheduler::SessionKey session = 1; session <= 6; ++session) {
      if (desk.streams.contains(session)) desk.serve(session);
    }
  }
  EXPECT_EQ(desk.turns.scheduler().waiting(), 0U);
  EXPECT_EQ(desk.turns.scheduler().running(), 0U);
  EXPECT_TRUE(desk.turns.running().empty());
  for (const auto& [key, item] : desk.items) {
    EXPECT_TRUE(item.released || item.gone) << "request " << key;
    interrupted += item.interruptions > 0 ? 1U : 0U;
  }
  EXPECT_GT(interrupted, 5U) << "the sequence is to try interruptions";
}

INSTANTIATE_TEST_SUITE_P(Turns, AnySequence, ::testing::Range(1U, 25U));

}  // namespace
}  // namespace pmcd::turns
