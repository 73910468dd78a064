// SPDX-License-Identifier: GPL-3.0-or-later
// Rules, the active rule, changes and their history: documents as the contract has them, to exact lines.
#include "admin-cli/rule_text.h"

#include <gtest/gtest.h>

namespace pmcd::admin {
namespace {

ordered_json fcsf() {
  return ordered_json::parse(R"({"rule":"fcsf","text":"fcsf burst=2 quantum=500 slots=1",
    "options":{"burst":"2","quantum":"500","slots":"1"},"version":4,"since":"2026-11-26T20:41:06Z",
    "by":{"uid":0,"pid":123},"sources":{"rule":"live change","quantum":"command line","slots":"default"},
    "uplink_kbit":5000,"uplink_measured":true})");
}

TEST(RuleText, RulesWithTheirOptions) {
  const auto document = ordered_json::parse(R"({"rules":[
    {"name":"fifo","summary":"First come.","options":[]},
    {"name":"srpt","summary":"Nearest to the end.","options":[
      {"name":"scope","values":["mesh","packet"],"default":"mesh","summary":"what counts"}]}],
    "common_options":[{"name":"aging","value":"seconds","default":"0","summary":"older ones first"},
                      {"name":"slots","value":"1 to 1024, or auto","default":"1","summary":"at a time"}]})");
  const Lines expected{"fifo  First come.",
                       "srpt  Nearest to the end.",
                       "        scope=mesh|packet  what counts (default mesh)",
                       "",
                       "Options of every rule:",
                       "  aging  seconds             older ones first (default 0)",
                       "  slots  1 to 1024, or auto  at a time (default 1)"};
  EXPECT_EQ(rules_lines(document), expected);
  EXPECT_EQ(rules_lines(ordered_json::object()), Lines{});
}

TEST(RuleText, TheActiveRuleAndWhereItsValuesComeFrom) {
  const Lines expected{"rule     fcsf burst=2 quantum=500 slots=1",
                       "version  4",
                       "since    2026-11-26T20:41:06Z",
                       "by       uid 0, pid 123",
                       "uplink   5.00 Mbit/s, measured",
                       "",
                       "name     value  from",
                       "rule     fcsf   live change",
                       "burst    2      live change",
                       "quantum  500    command line",
                       "slots    1      default"};
  EXPECT_EQ(rule_lines(fcsf()), expected);
}

TEST(RuleText, ARuleOfTheConfiguration) {
  ordered_json rule = fcsf();
  rule["by"] = nullptr;
  rule["uplink_measured"] = false;
  EXPECT_EQ(rule_lines(rule)[3], "by       the configuration");
  EXPECT_EQ(rule_lines(rule)[4], "uplink   5.00 Mbit/s, as configured");
  rule["uplink_kbit"] = nullptr;
  EXPECT_EQ(rule_lines(rule)[4], "uplink   not known yet");
}

ordered_json change(const char* before, const char* after, bool changed, bool dry_run) {
  return {{"changed", changed},
          {"dry_run", dry_run},
          {"warnings", {"a restart would forget it", 3}},
          {"before", {{"text", before}, {"version", 3}}},
          {"after", {{"text", after}, {"version", 4}}}};
}

TEST(RuleText, Changes) {
  EXPECT_EQ(change_line(change("fifo slots=1", "fcsf burst=2", true, false)), "rule: fifo slots=1 -> fcsf burst=2");
  EXPECT_EQ(change_line(change("fifo slots=1", "fcsf burst=2", false, true)),
            "rule: fifo slots=1 -> fcsf burst=2 (dry run: nothing was changed)");
  EXPECT_EQ(change_line(change("fifo", "fifo", false, true)), "rule: fifo (dry run: nothing would change)");
  ordered_json pinned = change("fifo", "fifo", false, true);
  pinned["would_change"] = true;
  EXPECT_EQ(change_line(pinned), "rule: fifo (dry run: it would be a live change)");
  EXPECT_EQ(change_line(change("fifo", "fifo", false, false)), "rule: fifo (nothing changed)");
  EXPECT_EQ(change_line(change("fifo", "fifo", true, false)), "rule: fifo (now version 4)")
      << "the same values, but from another source";
  EXPECT_EQ(change_warnings(change("a", "b", true, false)), Lines{"a restart would forget it"});
  EXPECT_EQ(change_warnings(ordered_json::object()), Lines{});
}

TEST(RuleText, History) {
  const auto document = ordered_json::parse(R"({"changes":[
    {"number":12,"changed_at":"2026-11-26T20:41:06Z","rule":"fcsf","options":"burst=2","uid":0,"pid":77,"reverts":3},
    {"number":11,"changed_at":"2026-11-26T20:40:06Z","rule":null,"options":"","uid":1000,"pid":9,"reverts":null},
    {"number":3,"changed_at":"2026-11-25T20:40:06Z","rule":"fifo","options":"","uid":0,"pid":8,"reverts":null}]})");
  const Lines expected{"number  changed_at             uid  pid  rule",
                       "    12  2026-11-26T20:41:06Z     0   77  fcsf burst=2 (back to 3)",
                       "    11  2026-11-26T20:40:06Z  1000    9  (the configuration)",
                       "     3  2026-11-25T20:40:06Z     0    8  fifo"};
  EXPECT_EQ(history_lines(document), expected);
}

TEST(RuleText, ADamagedChangeStandsInItsPlace) {
  const auto document = ordered_json::parse(R"({"changes":[
    {"number":12,"changed_at":"2026-11-26T20:41:06Z","rule":"fcsf","options":"","uid":0,"pid":77,"reverts":null},
    {"number":3,"changed_at":"2026-11-25T20:40:06Z","rule":"fifo","options":"","uid":0,"pid":8,"reverts":null}],
    "damaged":[{"number":11,"error":"the rule's name has 80 bytes, more than 64"}]})");
  const Lines expected{"number  changed_at            uid  pid  rule", "    12  2026-11-26T20:41:06Z    0   77  fcsf",
                       "    11  -                       -    -  (damaged: the rule's name has 80 bytes, more than 64)",
                       "     3  2026-11-25T20:40:06Z    0    8  fifo"};
  EXPECT_EQ(history_lines(document), expected);
}

}  // namespace
}  // namespace pmcd::admin
