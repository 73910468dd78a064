// SPDX-License-Identifier: MIT
// The judgement over a client's pace, on a clock of our own, and how much is sent to one ahead.
#include "daemon/turns/pace.h"

#include <gtest/gtest.h>

#include <chrono>
#include <utility>

#include "daemon/turns/line.h"

namespace pmcd::turns {
namespace {

using namespace std::chrono_literals;
using Verdict = Pace::Verdict;

class PaceTest : public testing::Test {
 protected:
  void begin() { pace_.begin(acknowledged_, now_); }
  /// `time` passes in steps of 250 ms, in each of which `bytes` are acknowledged; the first verdict that is not fine
  /// and how long that took.
  std::pair<Verdict, Time> run(Time time, std::uint64_t bytes, bool owes = true) {
    for (Time passed = 250ms; passed <= time; passed += 250ms) {
      now_ += 250ms;
      acknowledged_ += bytes;
      const Verdict verdict = pace_.note(acknowledged_, owes, now_, limits_);
      if (verdict != Verdict::fine) return {verdict, passed};
    }
    return {Verdict::fine, time};
  }

  Limits limits_;
  Time now_{1000s};
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
  Time turn{0};
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

/// A modem is sent no more than its line takes in less than half a second; who answers fast may take all there is.
TEST(UnderWay, IsWhatIsTakenInARoundTripAndAQuarterOfASecond) {
  const std::size_t first = 4'096;
  EXPECT_EQ(enough_under_way(0, 0ms, first), 8'192U) << "nothing is known of it";
  EXPECT_EQ(enough_under_way(33'600, 150ms, first), 13'440U);
  EXPECT_EQ(enough_under_way(100'000, 30ms, first), 28'000U) << "nine times what a round trip takes";
  EXPECT_EQ(enough_under_way(1e300, 30ms, first), 1'000'000'000U);
}

}  // namespace
}  // namespace pmcd::turns
