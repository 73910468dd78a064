// SPDX-License-Identifier: GPL-3.0-or-later
// A picture of the live view: what stands in it, and that it fits whatever terminal there is.
#include "admin-cli/watch_text.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>

namespace pmcd::admin {
namespace {

/// `served`: clients 1 and up, the odd ones waiting, every fourth running.
Snapshot snapshot(int clients, int requests, int more) {
  Snapshot s;
  s.rule = {{"text", "fifo slots=1"}, {"version", 4}, {"uplink_kbit", 5000}};
  s.clients = {{"uplink_kbit", 5000}, {"clients", ordered_json::array()}};
  for (int i = 1; i <= clients; ++i) {
    s.clients["clients"].push_back({{"client", i},
                                    {"speed_kbit", 800},
                                    {"taking_kbit", i % 4 == 0 ? 1250 : 0},
                                    {"bytes", 34'100},
                                    {"share", 0.25},
                                    {"mesh", "bunny"},
                                    {"level", 3},
                                    {"levels", 12},
                                    {"waiting", i % 2},
                                    {"running", i % 4 == 0 ? 1 : 0}});
  }
  s.queue = {{"waiting", requests + more}, {"running", 0}, {"requests", ordered_json::array()}, {"more", more}};
  for (int i = 1; i <= requests; ++i) {
    s.queue["requests"].push_back({{"rank", i},
                                   {"state", "waiting"},
                                   {"client", i},
                                   {"mesh", "bunny"},
                                   {"packet", 3},
                                   {"bytes_left", 812},
                                   {"asked_seconds_ago", 1},
                                   {"queued_seconds_ago", 1},
                                   {"reason", "waits for 1.00 s"}});
  }
  return s;
}

TEST(WatchText, AllOfIt) {
  const Lines expected{"fifo slots=1  version 4",
                       "uplink 1.25 Mbit/s of 5.00 Mbit/s [####............]",
                       "",
                       "client       speed       taking    bytes   share  level            mesh",
                       "     4  800 kbit/s  1.25 Mbit/s  34.1 kB  25.0 %  [##......] 3/12  bunny",
                       "     1  800 kbit/s     0 kbit/s  34.1 kB  25.0 %  [##......] 3/12  bunny",
                       "     3  800 kbit/s     0 kbit/s  34.1 kB  25.0 %  [##......] 3/12  bunny",
                       "     2  800 kbit/s     0 kbit/s  34.1 kB  25.0 %  [##......] 3/12  bunny",
                       "",
                       "queue: 1 waiting, 0 running",
                       "rank  state    client  mesh   packet   left   asked  queued  reason",
                       "   1  waiting       1  bunny       3  812 B  1.00 s  1.00 s  waits for 1.00 s"};
  EXPECT_EQ(snapshot_lines(snapshot(4, 1, 0), {}), expected) << "who is served first, then who waits";
}

TEST(WatchText, AnIdleDaemonWhoseUplinkIsNotKnown) {
  Snapshot idle = snapshot(0, 0, 0);
  idle.clients["uplink_kbit"] = nullptr;
  idle.rule["uplink_kbit"] = nullptr;
  const Lines expected{"fifo slots=1  version 4",
                       "uplink 0 kbit/s of an unknown rate",
                       "",
                       "client  speed  taking  bytes  share  level  mesh",
                       "",
                       "queue: 0 waiting, 0 running"};
  EXPECT_EQ(snapshot_lines(idle, {80, 24}), expected);
}

TEST(WatchText, AClientWithoutAMeshHasNoBar) {
  Snapshot s = snapshot(1, 0, 0);
  for (const char* name : {"mesh", "level", "levels", "speed_kbit"}) s.clients["clients"][0][name] = nullptr;
  EXPECT_EQ(snapshot_lines(s, {})[4], "     1      -  0 kbit/s  34.1 kB  25.0 %  -      -");
}

TEST(WatchText, BothTablesAreCutWhereBothAreLong) {
  const Lines lines = snapshot_lines(snapshot(40, 40, 500), {80, 15});
  ASSERT_EQ(lines.size(), 15u);
  EXPECT_EQ(lines[3].substr(0, 6), "client");
  EXPECT_EQ(lines[7], "... and 37 more");
  EXPECT_EQ(lines[9], "queue: 540 waiting, 0 running");
  EXPECT_EQ(lines[10].substr(0, 4), "rank");
  EXPECT_EQ(lines[13].substr(0, 4), "   3");
  EXPECT_EQ(lines[14], "... and 537 more");
}

TEST(WatchText, RoomThatOneTableDoesNotNeedGoesToTheOther) {
  const Lines many_clients = snapshot_lines(snapshot(40, 1, 0), {80, 25});
  ASSERT_EQ(many_clients.size(), 25u);
  EXPECT_EQ(many_clients[20], "... and 24 more");
  EXPECT_EQ(many_clients[24].substr(0, 4), "   1");
  const Lines long_queue = snapshot_lines(snapshot(1, 40, 0), {80, 25});
  ASSERT_EQ(long_queue.size(), 25u);
  EXPECT_EQ(long_queue[23].substr(0, 4), "  16");
  EXPECT_EQ(long_queue[24], "... and 24 more");
}

TEST(WatchText, WhatTheDaemonLeftOutIsCountedToo) {
  const Lines lines = snapshot_lines(snapshot(1, 2, 7), {});
  EXPECT_EQ(lines.back(), "... and 7 more");
}

TEST(WatchText, ItFitsAnyTerminal) {
  EXPECT_TRUE(rc::check("lines and columns are never exceeded, and no room is left while something is missing", [] {
    const ScreenSize size{*rc::gen::inRange<std::size_t>(0, 120), *rc::gen::inRange<std::size_t>(0, 60)};
    const Lines lines =
        snapshot_lines(snapshot(*rc::gen::inRange(0, 50), *rc::gen::inRange(0, 50), *rc::gen::inRange(0, 3)), size);
    RC_ASSERT(lines.size() <= *size.rows);
    for (const std::string& line : lines) RC_ASSERT(width_of(line) <= *size.columns);
    const bool cut = std::any_of(lines.begin(), lines.end() - (lines.empty() ? 0 : 1),
                                 [](const std::string& line) { return line.rfind("... and", 0) == 0; });
    if (cut) RC_ASSERT(lines.size() == *size.rows);
  }));
}

}  // namespace
}  // namespace pmcd::admin
