// SPDX-License-Identifier: MIT
// Plans as users write them, right and wrong.
#include "sim/plan.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/sim/support.h"

namespace pmcd::sim {
namespace {

const std::string kLines = R"("lines":[{"name":"dsl","down_kbit":1024,"up_kbit":256,"rtt_ms":40,"queue_bytes":32000},)"
                           R"({"name":"modem","down_kbit":33.6,"up_kbit":33.6,"rtt_ms":150}])";

std::string error_of(const std::string& text) {
  const auto parsed = parse_plan(text, "p", paper_scenario(), {});
  const Problem* problem = problem_of(parsed);
  return problem == nullptr ? "" : problem->text;
}

TEST(Plan, says_who_comes_when_over_which_line_and_fetches_what) {
  const auto parsed = parse_plan("{" + kLines + R"(,"uplink_kbit":2048,"uplink_queue_bytes":32000,"open":1,"clients":[
      {"line":"modem","mesh":"bunny"},
      {"arrives":1.5,"line":"dsl","meshes":["horse","hand"],"stalls_after":3,"leaves_after":null,"joins_after":0.25},
      {"arrives":2,"line":"dsl","mesh":"horse","leaves_after":0}]})",
                                 "p", paper_scenario(), {});
  ASSERT_EQ(problem_of(parsed), nullptr) << problem_of(parsed)->text;
  const auto& plan = std::get<Scenario>(parsed);
  EXPECT_EQ(plan.uplink_kbit, 2048);
  EXPECT_EQ(plan.uplink_queue_bytes, 32'000);
  EXPECT_EQ(plan.open, 1U);
  ASSERT_EQ(plan.lines.size(), 2U);
  EXPECT_EQ(plan.lines[0].name, "dsl");
  EXPECT_EQ(plan.lines[0].down_kbit, 1024);
  EXPECT_EQ(plan.lines[0].up_kbit, 256);
  EXPECT_DOUBLE_EQ(plan.lines[0].round_trip, 0.040);
  EXPECT_EQ(plan.lines[0].queue_bytes, 32'000);
  EXPECT_EQ(plan.lines[1].queue_bytes, 0);
  ASSERT_EQ(plan.clients.size(), 3U);
  EXPECT_EQ(plan.clients[0].line, 1U);
  EXPECT_EQ(plan.clients[0].arrives, 0);
  EXPECT_EQ(plan.clients[0].meshes, (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(plan.clients[0].stalls_after, std::nullopt);
  EXPECT_EQ(plan.clients[1].arrives, 1.5);
  EXPECT_EQ(plan.clients[1].meshes, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(plan.clients[1].stalls_after, 3U);
  EXPECT_EQ(plan.clients[1].leaves_after, std::nullopt);
  EXPECT_EQ(plan.clients[1].joins_after, 0.25);
  EXPECT_EQ(plan.clients[2].leaves_after, 0U);
  EXPECT_EQ(plan.clients[2].joins_after, std::nullopt);
}

TEST(Plan, may_bring_its_own_meshes) {
  const auto parsed = parse_plan("{" + kLines +
                                     R"(,"meshes":[{"name":"cube","levels":[{"bytes":300,"vertices":8}]}],)"
                                     R"("clients":[{"line":"dsl","mesh":"cube"}]})",
                                 "p", paper_scenario(), {});
  ASSERT_EQ(problem_of(parsed), nullptr) << problem_of(parsed)->text;
  ASSERT_EQ(std::get<Scenario>(parsed).meshes.size(), 1U);
  EXPECT_EQ(std::get<Scenario>(parsed).meshes[0].bytes, 300U);
  EXPECT_EQ(std::get<Scenario>(parsed).uplink_kbit, paper_scenario().uplink_kbit);
}

std::string client_error(const std::string& text) {
  return error_of("{" + kLines + ",\"clients\":[" + text + "]}");
}

TEST(Plan, errors_name_the_entry_its_field_and_its_value) {
  EXPECT_EQ(error_of("{"), "p: is no JSON");
  EXPECT_EQ(error_of("[]"), "p: is [], not an object");
  EXPECT_EQ(error_of("{}"), "p: has no \"lines\"");
  EXPECT_EQ(error_of(R"({"lines":[]})"), "p: lines is [], not an array with something in it");
  EXPECT_EQ(error_of("{" + kLines + "}"), "p: has no \"clients\"");
  EXPECT_EQ(error_of(R"({"open":9,"lines":[]})"), "p: open is 9, not a number from 1.0 to 8.0");
  EXPECT_EQ(error_of(R"({"lines":[{"name":"a","down_kbit":0}]})"),
            "p: lines[0].down_kbit is 0, not a number from 0.1 to 1000000000.0");
  EXPECT_EQ(error_of(R"({"lines":[{"name":"a","down_kbit":1}]})"), "p: lines[0] has no \"up_kbit\"");
  EXPECT_EQ(error_of(R"({"lines":[{"name":"a","down_kbit":1,"up_kbit":1,"rtt_ms":1},{"name":3}]})"),
            "p: lines[1].name is 3, not a name");
  EXPECT_EQ(error_of(R"({"meshes":[{"name":"a","levels":[{"bytes":1,"vertices":1},{"bytes":1}]}]})"),
            "p: meshes[0].levels[1] has no \"vertices\"");
  EXPECT_EQ(error_of(R"({"meshes":[{"name":"a","packets":1}]})"), "p: meshes[0] has no \"vertices\"");
  EXPECT_EQ(client_error("7"), "p: clients[0] is 7, not an object");
  EXPECT_EQ(client_error(R"({"line":"dsl","mesh":"bunny"},[])"), "p: clients[1] is [], not an object");
  EXPECT_EQ(client_error(R"({"mesh":"bunny"})"), "p: clients[0] has no \"line\"");
  EXPECT_EQ(client_error(R"({"line":"isdn"})"), "p: clients[0].line is \"isdn\", none of the lines that there are");
  EXPECT_EQ(client_error(R"({"line":"dsl"})"), "p: clients[0] has no \"meshes\"");
  EXPECT_EQ(client_error(R"({"line":"dsl","mesh":"cow"})"),
            "p: clients[0].mesh is \"cow\", none of the meshes that there are");
  EXPECT_EQ(client_error(R"({"line":"dsl","meshes":["bunny","cow"]})"),
            "p: clients[0].meshes[1] is \"cow\", none of the meshes that there are");
  EXPECT_EQ(client_error(R"({"line":"dsl","mesh":"bunny","arrives":-1})"),
            "p: clients[0].arrives is -1, not a number from 0.0 to 1000000000.0");
  EXPECT_EQ(client_error(R"({"line":"dsl","mesh":"bunny","stalls_after":"x"})"),
            "p: clients[0].stalls_after is \"x\", not a number from 0.0 to 100000.0");
}

TEST(Plan, takes_meshes_as_they_are_shown_and_measured) {
  // As pmcctl show --json prints one, as bench/rules/run writes it, and as pmcctl list --json does.
  const auto parsed =
      parse_plan("{" + kLines + R"(,"clients":[{"line":"dsl","meshes":["shown","measured","listed"]}],"meshes":[
      {"name":"shown","generation":"00","vertices":8,"faces":12,"packets":1,"bytes":300,"lossless":true,"bits":12,
       "scalar":"float32","format_version":1,"box_min":[0,0,0],"box_max":[1,1,1],"ingested_at":"2026-11-22T03:04:05Z",
       "levels":[{"level":0,"bytes":300,"vertices":8,"faces":12,"bits":12,"error_rms":0.1,"error_max":null,
                  "crc32c":"00000000"}]},
      {"name":"measured","file":"m.off","levels":[{"level":0,"bytes":300,"vertices":8,"faces":12,"error_rms":null}]},
      {"name":"listed","generation":"01","vertices":8,"faces":12,"packets":1,"bytes":300,"lossless":true}]})",
                 "p", paper_scenario(), {});
  ASSERT_EQ(problem_of(parsed), nullptr) << problem_of(parsed)->text;
  EXPECT_EQ(std::get<Scenario>(parsed).meshes.size(), 3U);
}

TEST(Plan, what_the_command_line_says_too_is_refused) {
  const auto with = [](const std::string& fields) {
    const PlanOption given[] = {{"--uplink", "uplink_kbit"}, {"--open", "open"}};
    Scenario scenario = paper_scenario();
    scenario.uplink_kbit = 77;
    return parse_plan("{" + kLines + fields + R"(,"clients":[{"line":"dsl","mesh":"horse"}]})", "p", scenario, given);
  };
  const auto twice = with(",\"open\":2");
  ASSERT_NE(problem_of(twice), nullptr);
  EXPECT_EQ(problem_of(twice)->text, "p: has a \"open\", so --open cannot count: leave one of them out");
  EXPECT_TRUE(problem_of(twice)->is_usage);
  EXPECT_FALSE(problem_of(with(",\"opne\":2"))->is_usage);
  for (const char* fields : {"", ",\"uplink_kbit\":null", ",\"uplink_queue_bytes\":32000"}) {
    ASSERT_EQ(problem_of(with(fields)), nullptr) << problem_of(with(fields))->text;
    EXPECT_EQ(std::get<Scenario>(with(fields)).uplink_kbit, 77);
  }
}

TEST(Plan, refuses_at_every_level_what_means_nothing) {
  EXPECT_EQ(error_of(R"({"uplink_kbits":1})"), "p: has a \"uplink_kbits\", which means nothing here");
  EXPECT_EQ(error_of(R"({"lines":[{"name":"a","weight":2}]})"),
            "p: lines[0] has a \"weight\", which means nothing here");
  EXPECT_EQ(client_error(R"({"line":"dsl","mesh":"bunny"},{"line":"dsl","mesh":"bunny","leavs_after":3})"),
            "p: clients[1] has a \"leavs_after\", which means nothing here");
  EXPECT_EQ(error_of(R"({"meshes":[{"name":"a","colour":"red","levels":[]}]})"),
            "p: meshes[0] has a \"colour\", which means nothing here");
  EXPECT_EQ(error_of(R"({"meshes":[{"name":"a","levels":[{"bytes":1,"vertices":2,"error_rsm":0.1}]}]})"),
            "p: meshes[0].levels[0] has a \"error_rsm\", which means nothing here");
  EXPECT_EQ(client_error(R"({"line":"dsl","mesh":"bunny","meshes":["hand"]})"),
            "p: clients[0] has a \"mesh\" and \"meshes\": only one of them can count");
}

}  // namespace
}  // namespace pmcd::sim
