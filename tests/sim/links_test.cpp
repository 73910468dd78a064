// SPDX-License-Identifier: MIT
// The fluid uplink against shares that are found by trying, and against small steps of time.
#include "sim/links.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "sim/random.h"

namespace pmcd::sim {
namespace {

/// Max-min by filling: all rise together, who meets its cap stays there, until nothing is left.
std::vector<double> filled(double capacity, const std::vector<double>& caps) {
  std::vector<double> shares(caps.size(), 0);
  std::vector<bool> held(caps.size(), false);
  double left = capacity;
  while (true) {
    const auto rising = static_cast<double>(std::count(held.begin(), held.end(), false));
    if (rising == 0) return shares;
    double step = left / rising;
    for (std::size_t i = 0; i < caps.size(); ++i) {
      if (!held[i]) step = std::min(step, caps[i] - shares[i]);
    }
    bool somebody_held = false;
    for (std::size_t i = 0; i < caps.size(); ++i) {
      if (held[i]) continue;
      shares[i] += step;
      left -= step;
      if (shares[i] >= caps[i] * (1 - 1e-12)) held[i] = somebody_held = true;
    }
    if (!somebody_held) return shares;
  }
}

TEST(Uplink, one_flow_is_held_by_its_line_or_by_the_uplink) {
  Uplink uplink(1000);
  const auto slow = uplink.add();
  uplink.set_cap(slow, 100);
  uplink.move_to(slow, 50);
  EXPECT_DOUBLE_EQ(uplink.rate(slow), 100);
  EXPECT_TRUE(uplink.is_capped(slow));
  ASSERT_TRUE(uplink.next());
  EXPECT_DOUBLE_EQ(uplink.next()->at, 0.5);
  uplink.set_cap(slow, 5000);
  EXPECT_DOUBLE_EQ(uplink.rate(slow), 1000);
  EXPECT_FALSE(uplink.is_capped(slow));
  EXPECT_DOUBLE_EQ(uplink.next()->at, 0.05);
  EXPECT_EQ(uplink.take_next(), slow);
  EXPECT_DOUBLE_EQ(uplink.position(slow), 50);
  uplink.stop(slow);
  EXPECT_FALSE(uplink.next());
  EXPECT_DOUBLE_EQ(uplink.rate(slow), 0);
}

TEST(Uplink, what_a_slow_line_leaves_goes_to_the_others) {
  Uplink uplink(1000);
  const double caps[] = {100, 600, 600};
  for (const double cap : caps) uplink.set_cap(uplink.add(), cap);
  for (Uplink::Flow flow = 0; flow < 3; ++flow) uplink.move_to(flow, 900);
  EXPECT_DOUBLE_EQ(uplink.rate(0), 100);
  EXPECT_DOUBLE_EQ(uplink.rate(1), 450);
  EXPECT_DOUBLE_EQ(uplink.rate(2), 450);
  EXPECT_DOUBLE_EQ(uplink.next()->at, 2);
  uplink.advance(1);
  EXPECT_DOUBLE_EQ(uplink.position(1), 450);
  uplink.stop(2);
  EXPECT_DOUBLE_EQ(uplink.rate(1), 600);
  EXPECT_DOUBLE_EQ(uplink.next()->at, 1.75);
  EXPECT_DOUBLE_EQ(uplink.position(2), 450);
}

TEST(Uplink, shares_are_those_found_by_filling) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const double capacity = 100 + 900 * random.uniform();
    Uplink uplink(capacity);
    std::vector<double> caps(1 + random.below(20));
    std::vector<bool> moves(caps.size(), false);
    std::vector<double> positions(caps.size(), 0);
    for (double& cap : caps) {
      cap = 1 + 200 * random.uniform();
      uplink.set_cap(uplink.add(), cap);
    }
    double now = 0;
    for (int step = 0; step < 40; ++step) {
      const auto flow = static_cast<Uplink::Flow>(random.below(caps.size()));
      if (random.uniform() < 0.3) {
        caps[flow] = 1 + 200 * random.uniform();
        uplink.set_cap(flow, caps[flow]);
      } else if (moves[flow]) {
        uplink.stop(flow);
        moves[flow] = false;
      } else {
        uplink.move_to(flow, uplink.position(flow) + 1e6);
        moves[flow] = true;
      }
      std::vector<double> active;
      for (std::size_t i = 0; i < caps.size(); ++i) {
        if (moves[i]) active.push_back(caps[i]);
      }
      const auto expected = filled(capacity, active);
      const double pause = random.uniform();
      std::size_t k = 0;
      for (std::size_t i = 0; i < caps.size(); ++i) {
        const double rate = moves[i] ? expected[k++] : 0;
        ASSERT_NEAR(uplink.rate(static_cast<Uplink::Flow>(i)), rate, 1e-9 * capacity) << "seed " << seed;
        positions[i] += rate * pause;
      }
      now += pause;
      uplink.advance(now);
      for (std::size_t i = 0; i < caps.size(); ++i) {
        ASSERT_NEAR(uplink.position(static_cast<Uplink::Flow>(i)), positions[i], 1e-5) << "seed " << seed;
      }
    }
  }
}

TEST(Uplink, flows_reach_their_targets_in_the_order_of_time) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    Uplink uplink(500);
    std::vector<double> caps(8);
    std::vector<double> left(8);
    for (std::size_t i = 0; i < caps.size(); ++i) {
      caps[i] = 20 + 200 * random.uniform();
      left[i] = 10 + 1000 * random.uniform();
      uplink.set_cap(uplink.add(), caps[i]);
    }
    for (std::size_t i = 0; i < caps.size(); ++i) uplink.move_to(static_cast<Uplink::Flow>(i), left[i]);
    double now = 0;
    std::vector<bool> there(caps.size(), false);
    for (std::size_t round = 0; round < caps.size(); ++round) {
      std::vector<std::size_t> who;
      std::vector<double> active;
      for (std::size_t i = 0; i < caps.size(); ++i) {
        if (there[i]) continue;
        who.push_back(i);
        active.push_back(caps[i]);
      }
      const auto rates = filled(500, active);
      double pause = std::numeric_limits<double>::infinity();
      std::size_t first = 0;
      for (std::size_t k = 0; k < who.size(); ++k) {
        if (left[who[k]] / rates[k] >= pause) continue;
        pause = left[who[k]] / rates[k];
        first = who[k];
      }
      for (std::size_t k = 0; k < who.size(); ++k) left[who[k]] -= rates[k] * pause;
      now += pause;
      ASSERT_NEAR(uplink.next()->at, now, 1e-9) << "seed " << seed;
      ASSERT_EQ(uplink.take_next(), first) << "seed " << seed;
      uplink.stop(static_cast<Uplink::Flow>(first));
      there[first] = true;
    }
    EXPECT_FALSE(uplink.next());
  }
}

}  // namespace
}  // namespace pmcd::sim
