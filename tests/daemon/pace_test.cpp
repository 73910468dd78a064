// SPDX-License-Identifier: MIT
// The judgement over a client's pace, on a clock of our own, how much is sent to one ahead, and the counting of
// addresses.
#include "daemon/net/pace.h"

#include <gtest/gtest.h>

#include "daemon/net/address_table.h"
#include "daemon/net/data_line.h"
#include "daemon/net/log_budget.h"

namespace pmcd::net {
namespace {

using namespace std::chrono_literals;
using Verdict = Pace::Verdict;

class PaceTest : public testing::Test {
 protected:
  void begin() { pace_.begin(acknowledged_, now_); }
  /// `time` passes in steps of 250 ms, in each of which `bytes` are acknowledged; the first verdict that is not fine
  /// and how long that took.
  std::pair<Verdict, Duration> run(Duration time, std::uint64_t bytes, bool owes = true) {
    for (Duration passed = 250ms; passed <= time; passed += 250ms) {
      now_ += 250ms;
      acknowledged_ += bytes;
      const Verdict verdict = pace_.note(acknowledged_, owes, now_, limits_);
      if (verdict != Verdict::fine) return {verdict, passed};
    }
    return {Verdict::fine, time};
  }

  Limits limits_;
  Clock::time_point now_{1000s};
  std::uint64_t acknowledged_ = 5'000;
  Pace pace_;
};

TEST_F(PaceTest, StandingStillForTenSecondsIsStalled) {
  begin();
  EXPECT_EQ(run(9s, 0).first, Verdict::fine);
  EXPECT_EQ(run(250ms, 1).first, Verdict::fine);
  const auto [verdict, after] = run(60s, 0);
  EXPECT_EQ(verdict, Verdict::stalled);
  EXPECT_EQ(after, 10s);
}

TEST_F(PaceTest, WhoOwesNothingNeverStalls) {
  begin();
  EXPECT_EQ(run(3600s, 0, false).first, Verdict::fine);
  const auto [verdict, after] = run(60s, 0);
  EXPECT_EQ(verdict, Verdict::stalled);
  EXPECT_LE(after, 10s);
}

TEST_F(PaceTest, LessThanTheLeastRateOverThirtySecondsIsTooSlow) {
  begin();
  const auto [verdict, after] = run(300s, 100);  // 400 bytes a second
  EXPECT_EQ(verdict, Verdict::too_slow);
  EXPECT_GE(after, 30s);
  EXPECT_LE(after, 32s);
}

TEST_F(PaceTest, TheLeastRateItselfIsFine) {
  begin();
  EXPECT_EQ(run(600s, 125).first, Verdict::fine);  // 500 bytes a second
}

TEST_F(PaceTest, AFastBeginningDoesNotPayForLater) {
  begin();
  EXPECT_EQ(run(10s, 1'000'000).first, Verdict::fine);
  const auto [verdict, after] = run(300s, 50);
  EXPECT_EQ(verdict, Verdict::too_slow);
  EXPECT_LE(after, 33s) << "the window slides";
}

TEST_F(PaceTest, WithoutALeastRateOnlyStandingStillCounts) {
  limits_.min_rate = 0;
  begin();
  EXPECT_EQ(run(3600s, 1).first, Verdict::fine);
}

TEST_F(PaceTest, ManyShortTransfersAddUp) {
  Duration turn{0};
  Verdict verdict = Verdict::fine;
  // 1,000 bytes take 6 seconds, one of which belongs to the round trip: 200 bytes a second of its turn.
  for (int i = 0; i < 20 && verdict == Verdict::fine; ++i) {
    begin();
    verdict = run(6s, 1'000 / 24).first;
    turn += 5s;
    if (verdict == Verdict::fine) run(100s, 0, false);
  }
  EXPECT_EQ(verdict, Verdict::too_slow);
  EXPECT_GE(turn, 30s);
  EXPECT_LE(turn, 35s);
}

TEST_F(PaceTest, ALongRoundTripIsNoFault) {
  // Packets of 600 bytes over a line with 900 ms there and back: much less than 500 bytes a second, all of it waiting.
  for (int i = 0; i < 200; ++i) {
    begin();
    EXPECT_EQ(run(750ms, 0).first, Verdict::fine);
    acknowledged_ += 300;
    EXPECT_EQ(run(250ms, 0, false).first, Verdict::fine);
  }
}

TEST(LogBudget, BeginsAnewEachSecond) {
  LogBudget budget(3);
  const Clock::time_point start{1000s};
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(budget.take(start + i * 100ms));
  EXPECT_FALSE(budget.take(start + 500ms));
  EXPECT_FALSE(budget.take(start + 999ms));
  EXPECT_TRUE(budget.take(start + 1s));
  EXPECT_TRUE(budget.take(start + 1500ms));
}

TEST(AddressTable, CountsByAddressAndByNetwork) {
  AddressTable table(2);
  const auto key = [](const char* text) { return AddressTable::Key(asio::ip::make_address(text)); };
  EXPECT_TRUE(table.enter(key("192.0.2.1")));
  EXPECT_TRUE(table.enter(key("::ffff:192.0.2.1"))) << "the same address in another dress";
  EXPECT_FALSE(table.enter(key("192.0.2.1")));
  EXPECT_TRUE(table.enter(key("192.0.2.2")));
  EXPECT_TRUE(table.enter(key("2001:db8:1:2::1")));
  EXPECT_TRUE(table.enter(key("2001:db8:1:2:ffff::9")));
  EXPECT_FALSE(table.enter(key("2001:db8:1:2::3"))) << "the same network";
  EXPECT_TRUE(table.enter(key("2001:db8:1:3::1")));
  table.leave(key("192.0.2.1"));
  EXPECT_TRUE(table.enter(key("192.0.2.1")));
  EXPECT_EQ(table.addresses(), 4U);
  table.leave(key("192.0.2.2"));
  EXPECT_EQ(table.addresses(), 3U) << "who has left takes no memory";
}

/// A modem is sent no more than its line takes in less than half a second; who answers fast may take all there is.
TEST(UnderWay, IsWhatIsTakenInARoundTripAndAQuarterOfASecond) {
  const std::size_t first = 4'096;
  EXPECT_EQ(enough_under_way(0, 0ms, first), 8'192U) << "nothing is known of it";
  EXPECT_EQ(enough_under_way(33'600, 150ms, first), 13'440U);
  EXPECT_EQ(enough_under_way(100'000, 30ms, first), 28'000U) << "nine times what a round trip takes";
  EXPECT_EQ(enough_under_way(1e300, 30ms, first), 1'000'000'000U);
}

}  // namespace
}  // namespace pmcd::net
