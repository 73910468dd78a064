// SPDX-License-Identifier: MIT
// The small instruments of the scheduler: a median that runs along, the rate of the last half second, what the uplink
// carries, and what Clients makes of them.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <vector>

#include "daemon/scheduler/clients.h"
#include "daemon/scheduler/recent_rate.h"
#include "daemon/scheduler/uplink_meter.h"

namespace pmcd::scheduler {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(RunningMedian, LowerMiddleOfAnEvenNumber) {
  RunningMedian m;
  EXPECT_FALSE(m.median());
  m.insert(5);
  EXPECT_EQ(m.median(), 5);
  m.insert(1);
  EXPECT_EQ(m.median(), 1);
  m.insert(9);
  EXPECT_EQ(m.median(), 5);
  m.erase(5);
  EXPECT_EQ(m.median(), 1);
  m.erase(1);
  m.erase(9);
  EXPECT_FALSE(m.median());
}

TEST(RunningMedian, AsASortedListHasIt) {
  EXPECT_TRUE(rc::check("median of what comes and goes", [] {
    RunningMedian m;
    std::vector<double> all;
    const auto steps = *rc::gen::container<std::vector<std::pair<int, unsigned>>>(
        rc::gen::pair(rc::gen::inRange(0, 9), rc::gen::arbitrary<unsigned>()));
    for (const auto& [value, choice] : steps) {
      if (choice % 5 < 3 || all.empty()) {
        m.insert(value);  // few values, so that equal ones stand in both halves
        all.push_back(value);
      } else {
        const auto it = all.begin() + static_cast<std::ptrdiff_t>(choice / 5 % all.size());
        m.erase(*it);
        all.erase(it);
      }
      std::sort(all.begin(), all.end());
      RC_ASSERT(m.median().has_value() == !all.empty());
      if (!all.empty()) RC_ASSERT(*m.median() == all[(all.size() - 1) / 2]);
    }
  }));
}

TEST(RecentRate, ASteadyStreamIsItsRate) {
  RecentRate r;
  for (Time now{0}; now < seconds(3); now += milliseconds(3)) {
    r.note(300, now);
    if (now >= RecentRate::kSpan + milliseconds(50)) {
      ASSERT_LE(r.rate(now), 101'000);
      ASSERT_GE(r.rate(now), 99'000);
    }
  }
}

TEST(RecentRate, HalfASecondLaterNothingIsLeft) {
  RecentRate r;
  r.note(5'000, seconds(100));
  EXPECT_DOUBLE_EQ(r.rate(seconds(100) + milliseconds(49)), 0) << "its part is not whole";
  EXPECT_DOUBLE_EQ(r.rate(seconds(100) + milliseconds(50)), 10'000);
  EXPECT_DOUBLE_EQ(r.rate(seconds(100) + milliseconds(549)), 10'000);
  EXPECT_DOUBLE_EQ(r.rate(seconds(100) + milliseconds(550)), 0);
  EXPECT_DOUBLE_EQ(r.rate(seconds(5'000)), 0);
  r.note(1'000, seconds(5'000));
  EXPECT_DOUBLE_EQ(r.rate(seconds(5'000) + milliseconds(50)), 2'000);
}

TEST(UplinkMeter, TheBusiestWholeSecond) {
  UplinkMeter m;
  EXPECT_FALSE(m.capacity());
  m.note(500, milliseconds(100));
  m.note(700, milliseconds(900));
  EXPECT_FALSE(m.capacity()) << "the second is not over";
  m.note(100, milliseconds(1'100));
  EXPECT_EQ(m.capacity(), 1'200);
  m.note(5'000, milliseconds(2'100));
  EXPECT_EQ(m.capacity(), 1'200);
  m.note(1, milliseconds(3'000));
  EXPECT_EQ(m.capacity(), 5'000);
}

TEST(UplinkMeter, ForgetsAfterThirtyBusySeconds) {
  UplinkMeter m;
  m.note(9'000, Time{0});
  for (int second = 1; second <= 30; ++second) m.note(100, seconds(second));
  EXPECT_EQ(m.capacity(), 9'000);
  m.note(100, seconds(31));
  EXPECT_EQ(m.capacity(), 100);
  m.note(100, seconds(10'000));
  EXPECT_EQ(m.capacity(), 100) << "idle seconds are none";
}

TEST(Clients, FlutterOfSpeedIsNoChangeAndMediansFollow) {
  Clients c;
  const auto measure = [&c](SessionKey session, std::uint64_t from, std::uint64_t rate, Time now) {
    c.observe(session, {now, from, true, 0, Time{0}});
    return c.observe(session, {now + seconds(2), from + 2 * rate, false, 0, Time{0}});
  };
  EXPECT_TRUE(measure(1, 0, 20'000, Time{0}));
  EXPECT_EQ(c.find(1)->speed, 20'000);
  EXPECT_FALSE(measure(1, 40'000, 20'300, seconds(10)));
  EXPECT_EQ(c.find(1)->speed, 20'000);
  EXPECT_TRUE(measure(1, 80'600, 30'000, seconds(20)));
  EXPECT_TRUE(measure(2, 0, 80'000, seconds(20)));
  EXPECT_TRUE(measure(3, 0, 90'000, seconds(20)));
  EXPECT_EQ(c.median_speed(), 80'000);
  EXPECT_FALSE(c.median_active_speed());
  c.set_active(1, true);
  c.set_active(3, true);
  EXPECT_EQ(c.median_active_speed(), 30'000);
  c.set_active(1, false);
  EXPECT_EQ(c.median_active_speed(), 90'000);
  c.forget(3);
  EXPECT_FALSE(c.median_active_speed());
  EXPECT_EQ(c.median_speed(), 30'000);
  EXPECT_EQ(c.find(3), nullptr);
  EXPECT_EQ(c.size(), 2U);
}

TEST(Clients, AcknowledgedBytesAndWeights) {
  Clients c;
  EXPECT_FALSE(c.acknowledged(1, 0));
  EXPECT_TRUE(c.acknowledged(1, 10));
  EXPECT_TRUE(c.acknowledged(1, 5));
  EXPECT_EQ(c.find(1)->acknowledged, 15U);
  EXPECT_EQ(c.find(1)->weight, 1);
  EXPECT_FALSE(c.set_weight(1, 1));
  EXPECT_TRUE(c.set_weight(1, 5));
  EXPECT_EQ(c.find(1)->weight, 5);
}

TEST(Clients, WhatAClientTakesNow) {
  Clients c;
  for (int n = 0; n <= 100; ++n) {
    c.observe(1, {milliseconds(10 * n), static_cast<std::uint64_t>(1'000 * n), true, 0, Time{0}});
  }
  EXPECT_NEAR(c.taking(1, seconds(1)), 100'000, 10'000);
  EXPECT_EQ(c.taking(1, seconds(2)), 0);
  EXPECT_EQ(c.taking(2, seconds(1)), 0);
}

}  // namespace
}  // namespace pmcd::scheduler
