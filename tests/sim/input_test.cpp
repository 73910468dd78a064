// SPDX-License-Identifier: MIT
// What users write: meshes, lines, arrivals, rules and options, and what they are told when it is wrong.
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "sim/meshes.h"
#include "sim/policies.h"
#include "sim/scenario.h"

namespace pmcd::sim {
namespace {

template <typename T>
std::string error_of(const Result<T>& result) {
  const Problem* problem = problem_of(result);
  return problem == nullptr ? "" : problem->text;
}

std::vector<Mesh> parsed(const std::string& text) {
  const auto result = parse_meshes(text, "m");
  EXPECT_EQ(error_of(result), "");
  return problem_of(result) == nullptr ? std::get<std::vector<Mesh>>(result) : std::vector<Mesh>{};
}

const std::string kShown =
    R"({"name":"spot","bits":11,"box_min":[0,0,0],"box_max":[3,4,0],"levels":[
      {"level":0,"bytes":100,"vertices":10,"faces":16,"error_rms":0.04,"error_max":0.1},
      {"level":1,"bytes":200,"vertices":100,"faces":196,"error_rms":0.004},
      {"level":2,"bytes":300,"vertices":1000,"faces":1996,"error_rms":null}]})";

TEST(Meshes, shown_one_and_several) {
  const auto one = parsed(kShown);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0].name, "spot");
  EXPECT_EQ(one[0].bytes, 600U);
  EXPECT_EQ(one[0].levels[1].vertices, 100U);
  EXPECT_DOUBLE_EQ(one[0].levels[1].error, 0.004);
  EXPECT_EQ(one[0].levels[2].error, -1);
  EXPECT_EQ(one[0].profile->bytes_behind(0), 500U);
  EXPECT_EQ(one[0].level_at, (std::array<std::uint32_t, 3>{1, 2, 2}));
  EXPECT_EQ(parsed("[" + kShown + "," + kShown + "]").size(), 2U);
}

TEST(Meshes, listed_ones_have_modelled_levels) {
  const auto listed = parsed(
      R"({"meshes":[{"name":"a","vertices":50000,"bytes":200000,"packets":11},
                    {"name":"b","vertices":4,"bytes":90,"packets":1}],"damaged":[]})");
  ASSERT_EQ(listed.size(), 2U);
  ASSERT_EQ(listed[0].levels.size(), 11U);
  EXPECT_NEAR(static_cast<double>(listed[0].bytes), 200'000, 11);
  EXPECT_EQ(listed[0].levels[0].vertices, 60U);
  EXPECT_EQ(listed[0].levels[10].vertices, 50'000U);
  // As measured: the base is some hundred bytes, the last packet about half of all.
  EXPECT_LT(listed[0].levels[0].bytes, 500U);
  EXPECT_GT(listed[0].levels[10].bytes, 80'000U);
  EXPECT_LT(listed[0].levels[10].bytes, 140'000U);
  EXPECT_EQ(listed[0].level_at[0], 5U);
  ASSERT_EQ(listed[1].levels.size(), 1U);
  EXPECT_EQ(listed[1].bytes, 90U);
}

TEST(Meshes, table) {
  const auto meshes = parsed(
      "name,level,bytes,vertices,error\n"
      "a,0,100,10,0.5\r\n"
      "a,1,300,40,\n"
      "\n"
      "b,0,50,8,0\n");
  ASSERT_EQ(meshes.size(), 2U);
  EXPECT_EQ(meshes[0].bytes, 400U);
  EXPECT_EQ(meshes[0].levels[1].error, -1);
  EXPECT_EQ(meshes[1].name, "b");
  EXPECT_EQ(meshes[1].levels[0].error, 0);
}

TEST(Meshes, built_in_ones_are_plausible) {
  const auto meshes = built_in_meshes();
  ASSERT_EQ(meshes.size(), 10U);
  for (const Mesh& mesh : meshes) {
    EXPECT_LE(mesh.levels[0].bytes, mesh.bytes / 20) << mesh.name;
    EXPECT_LT(mesh.level_at[0], mesh.level_at[2]) << mesh.name;
    EXPECT_GT(mesh.level_at[0], 1U) << mesh.name;
  }
}

TEST(Meshes, what_is_wrong_is_named) {
  const auto wrong = [](const std::string& text) { return error_of(parse_meshes(text, "m.json")); };
  EXPECT_EQ(wrong(" \n"), "m.json: there is nothing in it");
  EXPECT_EQ(wrong("{\"name\":"), "m.json: is no JSON");
  EXPECT_EQ(wrong("[]"), "m.json: holds no mesh");
  EXPECT_EQ(wrong(R"({"meshes":[]})"), "m.json: holds no mesh");
  EXPECT_EQ(wrong("[3]"), "m.json: [0] is 3, not a mesh");
  EXPECT_EQ(wrong(R"([{"levels":[]}])"), "m.json: [0] has no \"name\"");
  EXPECT_EQ(wrong(R"([{"name":"a","levels":[]}])"), "m.json: [0].levels is [], not an array of 1 to 100000 levels");
  EXPECT_EQ(wrong(R"({"name":"a","levels":[{"bytes":1,"vertices":2},{"bytes":0,"vertices":2}]})"),
            "m.json: levels[1].bytes is 0, not a whole number from 1 to 1099511627776");
  EXPECT_EQ(wrong(R"({"name":"a","levels":[{"bytes":1}]})"), "m.json: levels[0] has no \"vertices\"");
  EXPECT_EQ(wrong(R"({"name":"a","levels":[{"bytes":1,"vertices":2,"error_rms":-3}]})"),
            "m.json: levels[0].error_rms is -3, not null or a number from 0 on");
  EXPECT_EQ(wrong(R"({"name":"a","vertices":5,"packets":2})"), "m.json: has no \"bytes\"");
  EXPECT_EQ(wrong(R"({"meshes":[{"name":"a","vertices":5,"packets":2}]})"), "m.json: meshes[0] has no \"bytes\"");
  const std::string header = "name,level,bytes,vertices,error\n";
  EXPECT_EQ(wrong("a,0,1,2,3\n"), "m.json: line 1: is neither JSON nor the header name,level,bytes,vertices,error");
  EXPECT_EQ(wrong(header), "m.json: holds no mesh");
  EXPECT_EQ(wrong(header + "a,0,1,2\n"), "m.json: line 2: has 4 fields, not 5 (name,level,bytes,vertices,error)");
  EXPECT_EQ(wrong(header + "a,1,1,2,\n"), "m.json: line 2: level is \"1\", not 0");
  EXPECT_EQ(wrong(header + "a,0,1,2,\na,2,1,2,\n"), "m.json: line 3: level is \"2\", not 1");
  EXPECT_EQ(wrong(header + "a,0,x,2,\n"), "m.json: line 2: bytes is \"x\", not a whole number from 1 on");
  EXPECT_EQ(wrong(header + "a,0,1,-2,\n"), "m.json: line 2: vertices is \"-2\", not a whole number");
  EXPECT_EQ(wrong(header + "a,0,1,2,nan\n"), "m.json: line 2: error is \"nan\", not empty or a number from 0 on");
  EXPECT_EQ(error_of(read_meshes("no/such.json")), "no/such.json: cannot be opened");
}

TEST(Lines, forms) {
  const auto plain = std::get<Line>(parse_line("dsl=1024/256/50"));
  EXPECT_EQ(plain.name, "dsl");
  EXPECT_EQ(plain.down_kbit, 1024);
  EXPECT_EQ(plain.up_kbit, 256);
  EXPECT_DOUBLE_EQ(plain.round_trip, 0.05);
  EXPECT_EQ(plain.weight, 1);
  EXPECT_EQ(std::get<Line>(parse_line("m=33.6/33.6/150:2.5")).weight, 2.5);
}

TEST(Lines, what_is_wrong_is_named) {
  const std::string form = "; it is NAME=DOWN/UP/RTT_MS[:WEIGHT], kbit/s and milliseconds";
  const std::string range = ", not a number from 0.1 to 1000000000";
  EXPECT_EQ(error_of(parse_line("dsl")), "line \"dsl\": has no =" + form);
  EXPECT_EQ(error_of(parse_line("=1/1/1")), "line \"=1/1/1\": has no name" + form);
  EXPECT_EQ(error_of(parse_line("d=x/1/1")), "line \"d=x/1/1\": DOWN is \"x\"" + range + form);
  EXPECT_EQ(error_of(parse_line("d=1/0/1")), "line \"d=1/0/1\": UP is \"0\"" + range + form);
  EXPECT_EQ(error_of(parse_line("d=1/1")), "line \"d=1/1\": RTT_MS is \"\", not a number from 0 to 1000000000" + form);
  EXPECT_EQ(error_of(parse_line("d=1/1/1:")), "line \"d=1/1/1:\": WEIGHT is \"\", not a number above 0" + form);
  EXPECT_EQ(error_of(parse_line("d=1/1/1:0")), "line \"d=1/1/1:0\": WEIGHT is \"0\", not a number above 0" + form);
}

TEST(ArrivalForms, values_and_errors) {
  EXPECT_EQ(std::get<ArrivalProcess>(parse_arrivals("at-once")).kind, Arrivals::at_once);
  EXPECT_EQ(std::get<ArrivalProcess>(parse_arrivals("every:2.5")).value, 2.5);
  EXPECT_EQ(std::get<ArrivalProcess>(parse_arrivals("poisson:40")).kind, Arrivals::poisson);
  for (const char* text : {"", "every", "every:-1", "poisson:0", "poisson:x", "often:2", "at-once:2"}) {
    EXPECT_EQ(error_of(parse_arrivals(text)),
              "arrivals \"" + std::string(text) + "\": not at-once, every:SECONDS or poisson:CLIENTS_A_SECOND");
  }
}

TEST(Crowds, are_as_asked) {
  Scenario scenario;
  scenario.lines = {{"common", 1, 1, 0, 3}, {"rare", 1, 1, 0, 1}};
  scenario.meshes = built_in_meshes();
  const auto clients = draw_clients(scenario, {4'000, {Arrivals::poisson, 10}, 3, 0.25, 5});
  double rare = 0;
  double stalled = 0;
  for (const ClientPlan& client : clients) {
    rare += client.line;
    stalled += client.stalls ? 1 : 0;
    ASSERT_EQ(client.meshes.size(), 3U);
    EXPECT_NE(client.meshes[0], client.meshes[1]);
    EXPECT_NE(client.meshes[0], client.meshes[2]);
    EXPECT_NE(client.meshes[1], client.meshes[2]);
  }
  EXPECT_NEAR(rare / 4'000, 0.25, 0.03);
  EXPECT_NEAR(stalled / 4'000, 0.25, 0.03);
  EXPECT_NEAR(clients.back().arrives, 400, 30);
  const auto even = draw_clients(scenario, {3, {Arrivals::every, 2}, 1, 0, 5});
  EXPECT_EQ(even[2].arrives, 4);
}

TEST(Policies, options_go_to_the_rules_that_have_them) {
  const auto read = read_policies({"fcsf", "fifo"}, {"burst=2", "slots=3"});
  ASSERT_EQ(error_of(read), "");
  const auto& policies = std::get<std::vector<scheduler::Policy>>(read);
  ASSERT_EQ(policies.size(), 2U);
  EXPECT_EQ(text_of(policies[0]), "fcsf aging=0 burst=2 quantum=250 slots=3 uplink=0");
  EXPECT_EQ(text_of(policies[1]), "fifo aging=0 quantum=250 slots=3 uplink=0");
  EXPECT_EQ(std::get<std::vector<scheduler::Policy>>(read_policies({"all"}, {})).size(), scheduler::all_rules().size());
}

TEST(Policies, a_rule_may_have_options_of_its_own) {
  const auto read = read_policies({"gain", " gain+until=5", "fcsf+burst=2 "}, {"slots=3"});
  ASSERT_EQ(error_of(read), "");
  const auto& policies = std::get<std::vector<scheduler::Policy>>(read);
  ASSERT_EQ(policies.size(), 3U);
  EXPECT_EQ(policies[0].rule_options, scheduler::RuleOptions{});
  EXPECT_EQ(policies[1].rule_options, (scheduler::RuleOptions{{"until", "5"}}));
  EXPECT_EQ(policies[2].rule_options, (scheduler::RuleOptions{{"burst", "2"}}));
  EXPECT_EQ(policies[1].slots, 3U);
  EXPECT_EQ(rule_text(policies[0]), "gain");
  EXPECT_EQ(rule_text(policies[1]), "gain+until=5");
}

TEST(Policies, errors_of_a_rules_own_options_are_those_of_options) {
  EXPECT_EQ(error_of(read_policies({"fifo+burst=2"}, {})), "option burst: is one of rule fcsf, not of rule fifo");
  EXPECT_EQ(error_of(read_policies({"fcsf", "fifo+burst=2"}, {})),
            "option burst: is one of rule fcsf, not of rule fifo");
  EXPECT_EQ(error_of(read_policies({"gain+until=6"}, {})).substr(0, 30), "option until: \"6\" is none of: ");
  EXPECT_EQ(error_of(read_policies({"gain+until"}, {})), "option \"until\" is not NAME=VALUE");
  EXPECT_EQ(error_of(read_policies({"gain+"}, {})), "option \"\" is not NAME=VALUE");
  EXPECT_EQ(error_of(read_policies({"gain+until=5+until=5"}, {})), "option until is given twice");
  EXPECT_EQ(error_of(read_policies({"gain+until=5"}, {"until=10"})), "option until is given twice");
  EXPECT_EQ(error_of(read_policies({"gain+slots=2"}, {})),
            "option slots: is one of every rule, not of rule gain alone; --option slots=2 gives it to all");
  EXPECT_EQ(error_of(read_policies({"all+until=5"}, {})),
            "rule \"all+until=5\": all is every rule, and has no options of its own");
  EXPECT_EQ(error_of(read_policies({"best+until=5"}, {})).substr(0, 27), "rule: \"best\" is none of: fi");
}

TEST(Policies, errors_are_the_daemons) {
  EXPECT_EQ(error_of(read_policies({"fifo"}, {"burst=2"})), "option burst: is one of rule fcsf, not of rule fifo");
  EXPECT_EQ(error_of(read_policies({"fifo"}, {"slots=0"})), "option slots: \"0\" is not 1 to 1024, or auto");
  EXPECT_EQ(error_of(read_policies({"fifo"}, {"slots"})), "option \"slots\" is not NAME=VALUE");
  EXPECT_EQ(error_of(read_policies({"fifo"}, {"slots=1", "slots=2"})), "option slots is given twice");
  EXPECT_EQ(error_of(read_policies({"first"}, {})).substr(0, 28), "rule: \"first\" is none of: fi");
}

}  // namespace
}  // namespace pmcd::sim
