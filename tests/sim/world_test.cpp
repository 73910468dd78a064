// SPDX-License-Identifier: MIT
// Whole runs: that they repeat, lose nothing, and take the times that can be worked out by hand.
#include "sim/world.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "sim/channel.h"
#include "sim/report.h"
#include "tests/sim/support.h"

namespace pmcd::sim {
namespace {

const std::vector<std::string> kOurs = {"slots=auto", "quantum=500"};

std::string text_of_run(std::uint64_t seed, const std::string& rule) {
  Scenario scenario = paper_scenario();
  scenario.clients = draw_clients(scenario, {60, {Arrivals::poisson, 0.5}, 2, 0.1, seed});
  const auto given = policy(rule, kOurs);
  return json_of("run", scenario, {{given, simulate(scenario, given)}}, true);
}

TEST(World, the_same_seed_gives_the_same_bytes_and_another_others) {
  for (const scheduler::RuleEntry& rule : scheduler::all_rules()) {
    const std::string name(rule.name);
    const std::string once = text_of_run(7, name);
    EXPECT_EQ(once, text_of_run(7, name)) << name;
    EXPECT_NE(once, text_of_run(8, name)) << name;
  }
}

TEST(World, a_client_alone_gets_what_its_line_or_the_uplink_carries) {
  for (std::uint32_t line = 0; line < 3; ++line) {
    for (const double uplink : {20.0, 256.0, 10'000.0}) {
      Scenario scenario = paper_scenario();
      scenario.uplink_kbit = uplink;
      scenario.clients = {{0, line, {0}, false}};
      const Outcome outcome = simulate(scenario, policy("fifo", {"slots=auto"}));
      ASSERT_EQ(outcome.fetches.size(), 1U);
      const double slower = std::min(uplink, scenario.lines[line].down_kbit) * 125 * 1448 / 1500;
      EXPECT_NEAR(best_time(scenario, outcome.fetches[0]), 5 * scenario.lines[line].round_trip + 150'000 / slower,
                  0.01);
      // With the headers of chunks, which on a modem are 512 bytes.
      const double headers = 34 * static_cast<double>(outcome.chunks) / slower;
      const double bound = best_time(scenario, outcome.fetches[0]) + headers;
      EXPECT_GE(outcome.fetches[0].complete, bound) << line << ' ' << uplink;
      EXPECT_LE(outcome.fetches[0].complete, 1.05 * bound) << line << ' ' << uplink;
    }
  }
}

TEST(World, first_packet_comes_after_the_set_up_and_a_round_trip) {
  Scenario scenario = paper_scenario();
  scenario.uplink_kbit = 1e6;
  scenario.lines = {{"far", 1e6, 1e6, 0.2, 1}};
  scenario.clients = {{3, 0, {0}, false}};
  for (const double setup : {0.0, 4.0}) {
    scenario.setup_round_trips = setup;
    const Outcome outcome = simulate(scenario, policy("fifo"));
    EXPECT_NEAR(outcome.fetches[0].first_level, (setup + 0.5) * 0.2, 0.001);
    EXPECT_DOUBLE_EQ(outcome.fetches[0].begins, 3);
  }
}

TEST(World, one_open_request_and_a_slot_cost_a_round_trip_a_packet) {
  Scenario scenario = paper_scenario();
  scenario.uplink_kbit = 1e6;
  scenario.lines = {{"far", 1e6, 1e6, 0.2, 1}};
  scenario.meshes = {model_mesh("m", 3'000, 9'000, 7)};
  scenario.clients = {{0, 0, {0}, false}};
  scenario.open = 1;
  const double one = simulate(scenario, policy("fifo")).fetches[0].complete;
  EXPECT_NEAR(one, (5 + 6) * 0.2, 0.01);
  // The slot waits for the last acknowledgement, whoever asks early.
  scenario.open = 4;
  EXPECT_NEAR(simulate(scenario, policy("fifo")).fetches[0].complete, one, 0.01);
  // With slots that are free when written, four at a time share a round trip: packets 0 to 3, then 4 to 6.
  EXPECT_NEAR(simulate(scenario, policy("fifo", {"slots=auto"})).fetches[0].complete, (5 + 1) * 0.2, 0.02);
}

TEST(World, a_window_opens_round_by_round) {
  Scenario scenario = paper_scenario();
  scenario.uplink_kbit = 1e6;
  scenario.lines = {{"far", 1e6, 1e6, 0.1, 1}};
  scenario.clients = {{0, 0, {0}, false}};
  scenario.setup_round_trips = 0;
  // Ten segments in the first round, twice as many in each that follows: 6 rounds carry 912,000 bytes, 7 twice that, at
  // the speed that the seventh needs for them.
  const double segments = 14'480;
  const std::uint64_t bytes = 1'300'000;
  scenario.meshes = {make_mesh("one packet", {{bytes, 1000, -1}}, 0)};
  const double in_seventh = static_cast<double>(bytes) * (1 + 34.0 / 4'096) - 63 * segments;
  const double expected = 0.1 * (6 + in_seventh / (64 * segments) + 0.5);
  EXPECT_NEAR(simulate(scenario, policy("fifo")).fetches[0].complete, expected, 0.01);
  // Nothing of this is left to be seen when the first window is large enough.
  scenario.tcp.initial_window = 1e9;
  EXPECT_NEAR(simulate(scenario, policy("fifo")).fetches[0].complete, 0.05, 0.02);
}

TEST(World, decoding_takes_its_time) {
  Scenario scenario = paper_scenario();
  scenario.uplink_kbit = 1e6;
  scenario.lines = {{"near", 1e6, 1e6, 0, 1}};
  scenario.clients = {{0, 0, {0}, false}};
  scenario.decode_rate = 50'000;
  EXPECT_NEAR(simulate(scenario, policy("fifo", {"slots=auto"})).fetches[0].complete, 3.0, 0.01);
  scenario.open = 1;
  EXPECT_NEAR(simulate(scenario, policy("fifo")).fetches[0].complete, 3.0, 0.01);
}

TEST(World, nothing_is_lost_or_sent_twice) {
  for (const scheduler::RuleEntry& rule : scheduler::all_rules()) {
    for (const auto& options : {std::vector<std::string>{}, std::vector<std::string>{"quantum=20", "slots=3"}, kOurs}) {
      Scenario scenario = paper_scenario();
      scenario.clients = draw_clients(scenario, {40, {Arrivals::every, 0.2}, 2, 0, 3});
      std::uint64_t bytes = 0;
      for (const ClientPlan& client : scenario.clients) {
        for (const std::uint32_t mesh : client.meshes) bytes += scenario.meshes[mesh].bytes;
      }
      const Outcome outcome = simulate(scenario, policy(std::string(rule.name), options));
      EXPECT_EQ(outcome.payload_bytes, bytes) << rule.name;
      ASSERT_EQ(outcome.fetches.size(), 80U);
      for (const Fetch& fetch : outcome.fetches) {
        EXPECT_GT(fetch.first_level, 0) << rule.name;
        EXPECT_GE(fetch.to_error[0], fetch.first_level);
        EXPECT_GE(fetch.to_error[1], fetch.to_error[0]);
        EXPECT_GE(fetch.to_error[2], fetch.to_error[1]);
        EXPECT_GE(fetch.complete, fetch.to_error[2]);
        EXPECT_GE(fetch.complete, best_time(scenario, fetch)) << rule.name;
      }
      EXPECT_EQ(outcome.dropped, 0U);
      EXPECT_GT(outcome.link_use, 0.1);
      EXPECT_LE(outcome.link_use, 1.0000001);
    }
  }
}

/// Experiment 1 in the paper's mode with a mesh of ten packets of 10,000 bytes, and the same distance for all: when
/// each client is complete.
std::vector<double> ten_equal_packets(const std::string& rule) {
  Scenario scenario = paper_scenario();
  for (Line& line : scenario.lines) line.round_trip = 0.05;
  const std::vector<scheduler::MeshProfile::Level> levels(10, {10'000, 100, -1});
  scenario.meshes = {make_mesh("even", levels, 0)};
  scenario.open = 1;
  scenario.setup_round_trips = 0;
  scenario.clients = paper_clients(scenario, 1, 1, 1);
  std::vector<double> times;
  for (const Fetch& fetch : simulate(scenario, policy(rule)).fetches) times.push_back(fetch.complete);
  return times;
}

TEST(World, first_in_first_out_makes_fast_clients_wait_for_the_modem) {
  // A packet takes the modem 2.47 s and 7 % for the headers of its small chunks, the others 0.33 s; each holds the slot
  // a round trip longer. Whoever is served in turn ends with the tenth round.
  const double modem = 10'000 / goodput(33.6) * (1 + 34.0 / 512) + 0.05;
  const double other = 10'000 / goodput(256) * 1.01 + 0.05;
  const auto fifo = ten_equal_packets("fifo");
  EXPECT_NEAR(fifo[0], 10 * modem + 18 * other, 0.03 * fifo[0]);
  EXPECT_NEAR(fifo[1], 10 * modem + 19 * other, 0.03 * fifo[1]);
  EXPECT_NEAR(fifo[2], 10 * modem + 20 * other, 0.03 * fifo[2]);
  // The fast ones share the uplink between them as soon as the modem is known: after its first packet.
  const auto fcsf = ten_equal_packets("fcsf");
  EXPECT_NEAR(fcsf[1], modem + 19 * other, 0.1 * fcsf[1]);
  EXPECT_NEAR(fcsf[2], modem + 20 * other, 0.1 * fcsf[2]);
  EXPECT_NEAR(fcsf[0], 10 * modem + 20 * other, 0.03 * fcsf[0]);
}

TEST(World, a_client_that_takes_nothing_is_dropped_and_blocks_the_slot_until_then) {
  Scenario scenario = paper_scenario();
  scenario.clients = {{0, 2, {0}, true}, {0, 2, {0}, false}};
  const Outcome one_slot = simulate(scenario, policy("fifo"));
  EXPECT_EQ(one_slot.dropped, 1U);
  EXPECT_EQ(one_slot.fetches[0].complete, kNever);
  EXPECT_GT(one_slot.fetches[0].first_level, 0);
  // Half a mesh for the one and a whole for the other, 7.4 s at 30.9 kB/s, and ten seconds in which nothing moves.
  EXPECT_NEAR(one_slot.fetches[1].complete, 7.3 + 10, 1.5);
  // A quantum interrupts who does not take its chunk.
  const Outcome quantum = simulate(scenario, policy("fifo", {"quantum=200"}));
  EXPECT_EQ(quantum.dropped, 1U);
  EXPECT_LT(quantum.fetches[1].complete, 10);
  EXPECT_EQ(quantum.fetches[0].complete, kNever);
}

TEST(World, who_stalls_behind_a_packet_is_dropped_and_who_leaves_there_is_not) {
  for (const bool stays : {true, false}) {
    Scenario scenario = paper_scenario();
    scenario.clients = {{0, 2, {0}, false}, {0, 2, {1}, false}};
    (stays ? scenario.clients[0].stalls_after : scenario.clients[0].leaves_after) = 3;
    const Outcome outcome = simulate(scenario, policy("fifo", {"slots=auto", "quantum=250"}));
    EXPECT_EQ(outcome.dropped, stays ? 1U : 0U);
    EXPECT_GT(outcome.fetches[0].first_level, 0);
    EXPECT_EQ(outcome.fetches[0].complete, kNever);
    EXPECT_GT(outcome.fetches[1].complete, 0);
  }
}

TEST(World, scale_divides_times_where_distance_is_nothing) {
  Scenario scenario = paper_scenario();
  for (Line& line : scenario.lines) line.round_trip = 0;
  scenario.clients = paper_clients(scenario, 2, 1, 1);
  const Outcome slow = simulate(scenario, policy("srpt"));
  scale_speeds(scenario, 10);
  const Outcome fast = simulate(scenario, policy("srpt"));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(fast.fetches[i].complete * 10, slow.fetches[i].complete, 0.15 * slow.fetches[i].complete) << i;
  }
}

}  // namespace
}  // namespace pmcd::sim
