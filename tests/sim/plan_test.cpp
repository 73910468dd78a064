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
  const auto parsed = parse_plan(text, "p", paper_scenario());
  const Problem* problem = problem_of(parsed);
  return problem == nullptr ? "" : problem->text;
}

TEST(Plan, says_who_comes_when_over_which_line_and_fetches_what) {
  const auto parsed = parse_plan("{" + kLines + R"(,"uplink_kbit":2048,"uplink_queue_bytes":32000,"open":1,"clients":[
      {"line":"modem","mesh":"bunny"},
      {"arrives":1.5,"line":"dsl","meshes":["horse","hand"],"stalls_after":3,"leaves_after":null,"joins_after":0.25},
      {"arrives":2,"line":"dsl","mesh":"horse","leaves_after":0}]})",
                                 "p", paper_scenario());
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
                                 "p", paper_scenario());
  ASSERT_EQ(problem_of(parsed), nullptr) << problem_of(parsed)->text;
  ASSERT_EQ(std::get<Scenario>(parsed).meshes.size(), 1U);
  EXPECT_EQ(std::get<Scenario>(parsed).meshes[0].bytes, 300U);
  EXPECT_EQ(std::get<Scenario>(parsed).uplink_kbit, paper_scenario().uplink_kbit);
}

TEST(Plan, errors_name_client_field_and_value) {
  EXPECT_EQ(error_of("{"), "p: is no JSON");
  EXPECT_EQ(error_of("[]"), "p: is [], not an object");
  EXPECT_EQ(error_of("{}"), "p: \"lines\" is no array with something in it");
  EXPECT_EQ(error_of("{" + kLines + "}"), "p: \"clients\" is no array with something in it");
  EXPECT_EQ(error_of(R"({"lines":[{"name":"a","down_kbit":0}]})"),
            "p: line 1: \"down_kbit\" is 0, not a number from 0.1 to 1000000000.0");
  EXPECT_EQ(error_of(R"({"lines":[{"name":"a","down_kbit":1}]})"), "p: line 1: has no \"up_kbit\"");
  const auto client = [](const std::string& text) { return error_of("{" + kLines + ",\"clients\":[" + text + "]}"); };
  EXPECT_EQ(client("7"), "p: client 1: is 7, not an object");
  EXPECT_EQ(client(R"({"mesh":"bunny"})"), "p: client 1: \"line\": null is no name");
  EXPECT_EQ(client(R"({"line":"isdn"})"), "p: client 1: line \"isdn\" is none of those that there are");
  EXPECT_EQ(client(R"({"line":"dsl"})"), "p: client 1: \"meshes\" is no array with something in it");
  EXPECT_EQ(client(R"({"line":"dsl","mesh":"cow"})"), "p: client 1: mesh \"cow\" is none of those that there are");
  EXPECT_EQ(client(R"({"line":"dsl","mesh":"bunny","arrives":-1})"),
            "p: client 1: \"arrives\" is -1, not a number from 0.0 to 1000000000.0");
  EXPECT_EQ(client(R"({"line":"dsl","mesh":"bunny","stalls_after":"x"})"),
            "p: client 1: \"stalls_after\" is \"x\", not a number from 0.0 to 100000.0");
}

}  // namespace
}  // namespace pmcd::sim
