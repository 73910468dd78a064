// SPDX-License-Identifier: MIT
// Steepest fall of visible error per byte: the index of a mesh's coming packets against all its prefixes tried one by
// one, what is floored, what stands in for errors that were not measured, and the order that follows.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

using Levels = std::vector<MeshProfile::Level>;

std::shared_ptr<const MeshProfile> profile(const Levels& levels, double finest = 0) {
  return std::make_shared<MeshProfile>(levels, finest);
}

/// The index as the table of rules has it: the best of all numbers m of next packets.
double index_of(const Levels& levels, double finest, std::uint32_t packet, std::uint64_t remaining) {
  const double floor = std::max(finest, std::exp2(-20));
  double best = 0;
  for (std::size_t last = packet; last < levels.size(); ++last) {
    double u = 0;
    auto bytes = static_cast<double>(remaining);
    for (std::size_t k = packet; k <= last; ++k) {
      if (k > 0) u += std::log2(std::max(levels[k - 1].error, floor)) - std::log2(std::max(levels[k].error, floor));
      if (k > packet) bytes += static_cast<double>(levels[k].bytes);
    }
    best = std::max(best, u / bytes);
  }
  return best;
}

TEST(MeshProfile, CountsHalvingsAndBytesBehind) {
  const MeshProfile p(Levels{{100, 4, 0.5}, {200, 8, 0.125}, {300, 16, 0.0625}}, 0);
  EXPECT_EQ(p.packets(), 3U);
  EXPECT_EQ(p.bytes_behind(0), 500U);
  EXPECT_EQ(p.bytes_behind(2), 0U);
  EXPECT_DOUBLE_EQ(p.gain(0), 0);
  EXPECT_DOUBLE_EQ(p.gain(1), 2);
  EXPECT_DOUBLE_EQ(p.gain(2), 1);
  EXPECT_DOUBLE_EQ(p.steepest(1, 200), 0.01);
  EXPECT_DOUBLE_EQ(p.steepest(1, 50), 0.04) << "a part of it is sent";
}

TEST(MeshProfile, ASmallWorthlessPacketDoesNotHideWhatComesBehind) {
  const MeshProfile p(Levels{{100, 4, 0.5}, {10, 5, 0.5}, {90, 16, 0.25}}, 0);
  EXPECT_DOUBLE_EQ(p.gain(1), 0);
  EXPECT_DOUBLE_EQ(p.steepest(1, 10), 0.01) << "1 halving in 100 bytes";
}

TEST(MeshProfile, ErrorsBelowHalfALatticeStepAreNone) {
  const MeshProfile p(Levels{{1, 4, 0.5}, {1, 8, 0.01}, {1, 16, 0.001}}, 0.125);
  EXPECT_DOUBLE_EQ(p.gain(1), 2);
  EXPECT_DOUBLE_EQ(p.gain(2), 0);
}

TEST(MeshProfile, FloorIsNeverBelowTwoToTheMinus20) {
  const double visible = std::exp2(-19);
  const MeshProfile p(Levels{{1, 4, visible}, {1, 8, 0}}, std::exp2(-40));
  EXPECT_DOUBLE_EQ(p.gain(1), 1);
}

TEST(MeshProfile, VerticesStandInForErrorsNotMeasured) {
  const MeshProfile p(Levels{{1, 4, -1}, {1, 32, -1}, {1, 64, 0.5}, {1, 64, 0.25}}, 0);
  EXPECT_DOUBLE_EQ(p.gain(1), 3);
  EXPECT_DOUBLE_EQ(p.gain(2), 1) << "one side measured is not enough";
  EXPECT_DOUBLE_EQ(p.gain(3), 1);
}

TEST(MeshProfile, IndexIsTheBestOfAllPrefixes) {
  EXPECT_TRUE(rc::check("steepest() against all prefixes", [] {
    const auto sizes = *rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(1, 50'000)));
    Levels levels;
    for (const int size : sizes) {
      // Errors mostly fall, but a level may be worse than the one before.
      const double error = std::exp2(-*rc::gen::inRange(0, 2'400) / 100.0);
      levels.push_back({static_cast<std::uint64_t>(size), 10, error});
    }
    const double finest = std::exp2(-*rc::gen::inRange(5, 30));
    const auto packet = static_cast<std::uint32_t>(*rc::gen::inRange<std::size_t>(0, levels.size()));
    const auto left = *rc::gen::inRange<std::uint64_t>(1, levels[packet].bytes + 1);
    const double expected = index_of(levels, finest, packet, left);
    RC_ASSERT(std::abs(MeshProfile(levels, finest).steepest(packet, left) - expected) <= 1e-9 * (expected + 1e-6));
  }));
}

TEST(GainRule, BasePacketsOfAllFirstSmallestFirst) {
  Driver d(policy_of("gain"));
  const auto best = profile({{100, 4, 1}, {1, 8, 1e-6}});
  const auto next = d.ask(1, 1, 0, 1, 1, best);
  const auto large = d.ask(2, 5'000, 1, 1, 0, best);
  const auto small = d.ask(3, 4'000, 1, 1, 0, best);
  EXPECT_EQ(d.serve_all(), (Keys{small, large, next}));
}

TEST(GainRule, SteepestFallFirst) {
  Driver d(policy_of("gain"));
  const auto flat = d.ask(1, 100, 0, 1, 1, profile({{9, 4, 0.5}, {100, 8, 0.25}}));     // 1 in 100
  const auto steep = d.ask(2, 300, 0, 2, 1, profile({{9, 4, 0.5}, {300, 8, 1e-3}}));    // 9 in 300
  const auto nothing = d.ask(3, 1, 0, 3, 1, profile({{9, 4, 0.25}, {1, 8, 0.5}}));      // gets worse
  const auto middle = d.ask(4, 100, 0, 4, 1, profile({{9, 4, 0.5}, {100, 8, 0.125}}));  // 2 in 100
  EXPECT_EQ(d.serve_all(), (Keys{steep, middle, flat, nothing}));
}

/// With until=5 a mesh that has come down to a twentieth of its first error waits for its end only, the shortest first.
TEST(GainRule, UntilAMeshIsGoodEnough) {
  Driver d(policy_of("gain", {{"until", "5"}}));
  const Levels levels{{9, 4, 0.5}, {10, 8, 0.026}, {10, 16, 0.025}, {10, 32, 1e-5}};
  const auto good_long = d.ask(1, 10, 900, 1, 3, profile(levels));
  const auto good_short = d.ask(2, 10, 500, 2, 3, profile(levels));
  const auto coarse = d.ask(3, 5'000, 0, 3, 2, profile(levels));  // 0.026 is more than a twentieth of 0.5
  EXPECT_EQ(d.serve_all(), (Keys{coarse, good_short, good_long}));
}

/// Who is faster than the uplink is no better than one that fills it, and one that was not measured may fill it: the
/// median of the measured ones, two of which are slow, would put it behind a longer mesh.
TEST(GainRule, GoodEnoughMeshesAreReckonedWithTheUplink) {
  Policy policy = policy_of("gain", {{"until", "5"}});
  policy.uplink = 100'000;
  Driver d(policy);
  d.measure(1, 5'000);
  d.measure(2, 5'000);
  d.measure(3, 400'000);
  const Levels levels{{9, 4, 0.5}, {10, 8, 0.026}, {10, 16, 0.025}, {10, 32, 1e-5}};
  const auto slow = d.ask(1, 10, 40'000, 1, 3, profile(levels));
  d.measure(5, 39'000);
  d.measure(6, 41'000);
  const auto held_down = d.ask(6, 10, 320'000, 4, 3, profile(levels));  // as long as it would have the uplink alone
  const auto slower = d.ask(5, 10, 130'000, 5, 3, profile(levels));     // as long as 333 kB would on the uplink
  const auto unknown = d.ask(4, 10, 300'000, 2, 3, profile(levels));
  const auto faster = d.ask(3, 10, 310'000, 3, 3, profile(levels));
  EXPECT_EQ(d.serve_all(), (Keys{unknown, faster, held_down, slower, slow}));
}

TEST(GainRule, ASlowClientCountsForItsShareOfTheUplink) {
  Policy policy = policy_of("gain");
  policy.uplink = 100'000;
  Driver d(policy);
  d.measure(1, 25'000);
  d.measure(2, 400'000);
  const auto slow = d.ask(1, 100, 0, 1, 1, profile({{9, 4, 0.5}, {100, 8, 0.0625}}));    // 3 in 100, a quarter of it
  const auto fast = d.ask(2, 100, 0, 2, 1, profile({{9, 4, 0.5}, {100, 8, 0.25}}));      // 1 in 100, and not four times
  const auto large = d.ask(2, 200, 0, 3, 1, profile({{9, 4, 0.5}, {200, 8, 0.21875}}));  // 1.19 in 200
  EXPECT_EQ(d.serve_all(), (Keys{fast, slow, large}));
}

TEST(GainRule, NewSpeedAndBytesSentMoveWhatWaits) {
  Policy policy = policy_of("gain");
  policy.uplink = 100'000;
  Driver d(policy);
  d.measure(1, 10'000);
  d.measure(2, 50'000);
  const auto p = profile({{9, 4, 0.5}, {1'000, 8, 0.25}});
  const auto a = d.ask(1, 1'000, 0, 1, 1, p);
  const auto b = d.ask(2, 1'000, 0, 1, 1, p);
  ASSERT_EQ(d.scheduler.ranking(1, d.now).front().key, b);
  d.measure(1, 90'000);
  ASSERT_EQ(d.take(), a);
  d.scheduler.complete(a, d.now);
  ASSERT_EQ(d.take(), b);
  const auto c = d.ask(3, 1'000, 0, 1, 1, p);  // not measured: as fast as the uplink
  ASSERT_TRUE(d.scheduler.requeue(b, 600, d.now));
  EXPECT_EQ(d.serve_all(), (Keys{b, c})) << "1 in 400 at half the speed is more than 1 in 1,000";
}

TEST(GainRule, TiesByQueuedAtThenSession) {
  Driver d(policy_of("gain"));
  const auto p = profile({{9, 4, 0.5}, {1'000, 8, 0.25}});
  const auto nine = d.ask(9, 1'000, 0, 1, 1, p);
  const auto four = d.ask(4, 1'000, 0, 1, 1, p);
  d.now += Time{1};
  const auto one = d.ask(1, 1'000, 0, 1, 1, p);
  EXPECT_EQ(d.serve_all(), (Keys{four, nine, one}));
}

}  // namespace
}  // namespace pmcd::scheduler
