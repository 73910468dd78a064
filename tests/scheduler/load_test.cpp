// SPDX-License-Identifier: MIT
// The kept sum of what is being served against one that is reckoned anew at each question.
#include "daemon/scheduler/load.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

namespace pmcd::scheduler {
namespace {

using std::chrono::milliseconds;

struct Turn {
  SessionKey session = 0;
  Time since{0};
};

double load_anew(const std::map<RequestKey, Turn>& turns, const Surroundings& surroundings, Time now) {
  double sum = 0;
  for (const auto& [key, turn] : turns) {
    double part = surroundings.uplink;
    if (const auto speed = surroundings.clients.find(turn.session)->speed) {
      if (*speed < 0.4 * part || *speed > part) part = *speed;
    } else if (const auto guess = surroundings.clients.guessed_speed(turn.session)) {
      part = std::min(part, *guess);
    }
    if (now - turn.since >= milliseconds(500)) part = std::min(part, surroundings.clients.taking(turn.session, now));
    sum += part;
  }
  return sum;
}

TEST(Load, IsWhatItWouldBeReckonedAnew) {
  EXPECT_TRUE(rc::check("events and questions", [] {
    std::mt19937 random(*rc::gen::arbitrary<unsigned>());
    const unsigned longest = *rc::gen::element(5U, 60U, 700U);
    Clients clients;
    Surroundings surroundings{clients, 50'000};
    Load load(surroundings);
    std::map<RequestKey, Turn> turns;
    std::map<SessionKey, std::uint64_t> positions;
    Time now{0};
    for (RequestKey n = 1; n < 400; ++n) {
      now += std::chrono::microseconds(random() % (1'000 * longest));
      const SessionKey session = 1 + random() % 6;
      clients.of(session);
      switch (random() % 8) {
        case 0:
          turns[n] = {session, now};
          load.served_since(n, session, now);
          break;
        case 1:
          if (turns.empty()) break;
          turns.begin()->second.since = std::max(Time{0}, now - milliseconds(random() % 800));
          load.served_since(turns.begin()->first, turns.begin()->second.session, turns.begin()->second.since);
          break;
        case 2:
          if (turns.empty()) break;
          load.ends(turns.begin()->first);
          turns.erase(turns.begin());
          break;
        case 3:
          surroundings.uplink = static_cast<double>(1'000 * (1 + random() % 100));
          break;
        default:
          positions[session] += random() % 20'000;
          clients.observe(session, {now, positions[session], random() % 8 != 0, 0, Time{0}});
          for (const auto& [key, turn] : turns) {
            if (turn.session == session) load.observed(key, now);
          }
      }
      if (random() % 3 == 0) RC_ASSERT(std::abs(load.sum(now) - load_anew(turns, surroundings, now)) < 1e-3);
    }
    load.clear();
    RC_ASSERT(load.sum(now) == 0);
  }));
}

TEST(Load, WhoIsServedForLongCountsForWhatItTakes) {
  Clients clients;
  const Surroundings surroundings{clients, 50'000};
  Load load(surroundings);
  clients.of(1);
  load.served_since(7, 1, milliseconds(1'010));
  EXPECT_EQ(load.sum(milliseconds(1'509)), 50'000) << "nothing is known of it: it may take everything";
  EXPECT_EQ(load.sum(milliseconds(1'510)), 0) << "and has taken nothing";
  load.served_since(7, 1, milliseconds(1'511));
  EXPECT_EQ(load.sum(milliseconds(1'512)), 50'000);
  load.ends(7);
  EXPECT_EQ(load.sum(milliseconds(1'513)), 0);
}

}  // namespace
}  // namespace pmcd::scheduler
