// SPDX-License-Identifier: MIT
// How fast a client takes what it is sent, on lines of known speed: right within a quarter as soon as the meter says
// anything, whatever the round trip, the pauses and how often it is asked; and what a line that changes does to it.
#include "daemon/scheduler/speed_meter.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/scheduler/line.h"

namespace pmcd::scheduler {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr double kKbit = 125;
constexpr double kSpeeds[] = {33.6 * kKbit, 1'024 * kKbit, 2'048 * kKbit};
constexpr int kRoundTrips[] = {20, 50, 137, 200, 600};
constexpr int kPolls[] = {1, 3, 7, 20};

void expect_near(const SpeedMeter& meter, double rate, const std::string& where) {
  ASSERT_TRUE(meter.speed()) << where;
  ASSERT_NEAR(*meter.speed(), rate, rate / 4) << where;
}

std::string place(double rate, int round_trip, int poll) {
  return std::to_string(rate) + " B/s, round trip " + std::to_string(round_trip) + " ms, polled every " +
         std::to_string(poll) + " ms";
}

TEST(SpeedMeter, UnbrokenSendingFromTheThresholdsOn) {
  for (const double rate : kSpeeds) {
    for (const int round_trip : kRoundTrips) {
      for (const int poll : kPolls) {
        SpeedMeter meter;
        Line line(rate, milliseconds(round_trip), milliseconds(poll));
        line.begin(meter, 10'000'000);
        const Time first_two = milliseconds(round_trip) + seconds(2);
        while (line.now < seconds(30)) {
          line.poll(meter);
          const bool measured = line.acknowledged() >= SpeedMeter::kFirstBytes || line.now >= first_two;
          ASSERT_EQ(meter.speed().has_value(), measured) << place(rate, round_trip, poll) << line.now.count();
          if (measured) expect_near(meter, rate, place(rate, round_trip, poll));
        }
      }
    }
  }
}

TEST(SpeedMeter, PacketsWithPausesBetweenThem) {
  for (const double rate : kSpeeds) {
    for (const int round_trip : kRoundTrips) {
      for (const int poll : kPolls) {
        for (const std::uint64_t packet : {400U, 2'000U, 8'000U, 20'000U, 60'000U}) {
          // What is through before anybody looks again can only be known to be at least as fast as that.
          const bool seen = static_cast<double>(packet) / rate >= 3e-3 * poll;
          SpeedMeter meter;
          Line line(rate, milliseconds(round_trip), milliseconds(poll));
          for (int n = 0; line.acknowledged() < 80'000; ++n) {
            line.begin(meter, packet);
            while (line.owed() > 0) {
              line.poll(meter);
              if (!meter.speed()) continue;
              const std::string where = place(rate, round_trip, poll) + ", packets of " + std::to_string(packet);
              if (seen) expect_near(meter, rate, where);
              ASSERT_LT(*meter.speed(), 1.25 * rate) << where;
            }
            line.now += milliseconds(13 * n % 450);
          }
          EXPECT_TRUE(meter.speed());
        }
      }
    }
  }
}

TEST(SpeedMeter, MixedPacketsFromBaseToLast) {
  for (const double rate : kSpeeds) {
    for (const int poll : kPolls) {
      SpeedMeter meter;
      Line line(rate, milliseconds(80), milliseconds(poll));
      for (int mesh = 0; mesh < 3; ++mesh) {
        for (const std::uint64_t packet : {400U, 1'100U, 3'000U, 7'000U, 15'000U, 30'000U, 60'000U}) {
          line.send(meter, packet);
          line.now += milliseconds(200);
        }
        expect_near(meter, rate, place(rate, 80, poll));
      }
    }
  }
}

TEST(SpeedMeter, NothingIsKnownBeforeButAGuess) {
  SpeedMeter meter;
  EXPECT_FALSE(meter.speed());
  EXPECT_FALSE(meter.guess());
  Line line(128'000, milliseconds(20), milliseconds(1));
  line.send(meter, 31'999);
  EXPECT_FALSE(meter.speed());
  ASSERT_TRUE(meter.guess());
  EXPECT_NEAR(*meter.guess(), 128'000, 32'000);
  line.send(meter, 1);
  EXPECT_TRUE(meter.speed());
}

TEST(SpeedMeter, IdleTimeDoesNotCount) {
  SpeedMeter meter;
  Line line(128'000, milliseconds(20), milliseconds(5));
  line.send(meter, 20'000);
  line.now += seconds(3'600);
  EXPECT_FALSE(meter.speed()) << "an hour of silence is not 2 s of sending";
  line.send(meter, 20'000);
  expect_near(meter, 128'000, "after an hour");
}

TEST(SpeedMeter, AStalledClientFallsAndComesBack) {
  SpeedMeter meter;
  Line line(128'000, milliseconds(50), milliseconds(10));
  line.begin(meter, 2'000'000);
  while (line.now < seconds(5)) line.poll(meter);
  expect_near(meter, 128'000, "before");
  line.stalled = true;
  const auto until = [&](Time then) {
    while (line.now < then) line.poll(meter);
    return *meter.speed();
  };
  EXPECT_GT(until(seconds(6)), 96'000) << "a second may be a lost segment";
  EXPECT_EQ(until(seconds(11)), 1);
  line.stalled = false;
  line.poll(meter);  // all that was held back comes at once
  while (line.now < seconds(13)) line.poll(meter);
  EXPECT_GT(*meter.speed(), 96'000);
}

TEST(SpeedMeter, WhoNeverAcknowledgesAnythingIsMeasuredToo) {
  SpeedMeter meter;
  Line line(128'000, milliseconds(50), milliseconds(10));
  line.stalled = true;
  line.begin(meter, 100'000);
  while (line.now < milliseconds(2'060)) line.poll(meter);
  ASSERT_TRUE(meter.speed());
  EXPECT_EQ(*meter.speed(), 1);
}

TEST(SpeedMeter, ALineThatBecomesSlowerOrFasterIsFollowed) {
  for (const auto& [before, after] : {std::pair{kSpeeds[2], kSpeeds[1]}, std::pair{kSpeeds[1], kSpeeds[2]},
                                      std::pair{kSpeeds[1], kSpeeds[0]}, std::pair{kSpeeds[0], kSpeeds[1]}}) {
    SpeedMeter meter;
    Line line(before, milliseconds(50), milliseconds(5));
    for (int n = 0; n < 5; ++n) line.send(meter, 20'000);
    expect_near(meter, before, "before");
    line.set_rate(after);
    for (int n = 0; n < 5; ++n) line.send(meter, 20'000);
    expect_near(meter, after, "after");
  }
}

TEST(SpeedMeter, TheKernelsRatesCountWhereSendingIsTooShortForOurs) {
  SpeedMeter meter;
  Time now{0};
  std::uint64_t position = 0;
  // Short packets seen late: 2,000 bytes each 20 ms look like 100 kB/s, and the kernel knows better, but for outliers.
  for (int n = 0; n < 40; ++n) {
    meter.note({now, position, true, 0, Time{0}});
    now += milliseconds(20);
    position += 2'000;
    meter.note({now, position, false, n % 5 == 0 ? 5e6 : 250'000.0, Time{0}});
    now += milliseconds(50);
  }
  ASSERT_TRUE(meter.speed());
  EXPECT_NEAR(*meter.speed(), 250'000, 1);
}

TEST(SpeedMeter, ASmallerPositionIsNoAcknowledgement) {
  SpeedMeter meter;
  meter.note({Time{0}, 50'000, true, 0, Time{0}});
  meter.note({seconds(1), 90'000, true, 0, Time{0}});
  meter.note({seconds(2), 10'000, true, 0, Time{0}});
  ASSERT_TRUE(meter.speed());
  EXPECT_NEAR(*meter.speed(), 40'000, 1) << "and what was there before the first sample neither";
}

}  // namespace
}  // namespace pmcd::scheduler
