// SPDX-License-Identifier: MIT
// Policies as an operator writes them: what is refused and by what name, how layers come together, and that what is
// written is read back the same.
#include "daemon/scheduler/policy.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

std::string complaint(const PolicyLayer& layer) {
  const auto error = check(layer);
  return error ? error->sentence() : "";
}

PolicyLayer common(const std::string& name, const std::string& value) {
  return {std::nullopt, {{name, value}}};
}

TEST(PolicyCheck, UnknownRuleIsRefusedByName) {
  const auto error = check({"fastest", {}});
  ASSERT_TRUE(error);
  EXPECT_TRUE(error->is_rule);
  EXPECT_EQ(error->subject, "rule");
  EXPECT_EQ(error->sentence(), "rule: \"fastest\" is none of: fifo, lcfs, spf, fcsf, srpt, fsp, gain, fair");
  EXPECT_NE(complaint({"", {}}), "");
  EXPECT_NE(complaint({"FIFO", {}}), "");
}

TEST(PolicyCheck, AllRulesAloneAreGood) {
  for (const RuleEntry& rule : all_rules()) EXPECT_EQ(complaint({std::string(rule.name), {}}), "");
  EXPECT_EQ(complaint({}), "");
}

TEST(PolicyCheck, UnknownOptionIsRefusedByName) {
  EXPECT_EQ(complaint({"fifo", {{"speed", "1"}}}), "option speed: no rule has it");
  EXPECT_EQ(complaint(common("", "1")), "option : no rule has it");
  const auto error = check(common("speed", "1"));
  ASSERT_TRUE(error);
  EXPECT_FALSE(error->is_rule);
}

TEST(PolicyCheck, AnotherRulesOptionSaysWhose) {
  EXPECT_EQ(complaint({"fifo", {{"burst", "2"}}}), "option burst: is one of rule fcsf, not of rule fifo");
  EXPECT_EQ(complaint({"fcsf", {{"scope", "mesh"}}}), "option scope: is one of rule srpt, not of rule fcsf");
  EXPECT_EQ(complaint(common("burst", "2")), "option burst: is one of rule fcsf, and no rule is given with it");
}

TEST(PolicyCheck, WordsOfARulesOption) {
  EXPECT_EQ(complaint({"fcsf", {{"burst", "1"}}}), "");
  EXPECT_EQ(complaint({"fcsf", {{"burst", "2"}}}), "");
  EXPECT_EQ(complaint({"fcsf", {{"burst", "3"}}}), "option burst: \"3\" is none of: 1, 2");
  EXPECT_EQ(complaint({"srpt", {{"scope", "packet"}}}), "");
  EXPECT_EQ(complaint({"srpt", {{"scope", "Mesh"}}}), "option scope: \"Mesh\" is none of: mesh, packet");
}

TEST(PolicyCheck, BoundsOfCommonOptions) {
  const std::pair<const char*, std::vector<const char*>> good[] = {{"quantum", {"0", "1", "600000"}},
                                                                   {"aging", {"0", "1", "86400"}},
                                                                   {"slots", {"1", "1024", "auto"}},
                                                                   {"uplink", {"0", "1", "100000000"}}};
  for (const auto& [name, values] : good) {
    for (const char* value : values) EXPECT_EQ(complaint(common(name, value)), "") << name << "=" << value;
  }
  const std::pair<const char*, std::vector<const char*>> bad[] = {
      {"quantum", {"-1", "600001", "", "1.5", "1ms", "auto", " 1", "99999999999999999999"}},
      {"aging", {"-1", "86401", "", "x"}},
      {"slots", {"0", "-1", "1025", "", "Auto", "all"}},
      {"uplink", {"-1", "100000001", "", "1e3", "nan"}}};
  for (const auto& [name, values] : bad) {
    for (const char* value : values) {
      const auto error = check(common(name, value));
      ASSERT_TRUE(error) << name << "=" << value;
      EXPECT_EQ(error->subject, std::string("option ") + name);
      EXPECT_EQ(error->text.find(std::string("\"") + value + "\" is not "), 0U) << error->text;
    }
  }
  EXPECT_EQ(complaint(common("slots", "0")), "option slots: \"0\" is not 1 to 1024, or auto");
}

TEST(PolicyCheck, StandardsAreWhatIsSaidOfThem) {
  PolicyLayer layer;
  for (const CommonOption& option : common_options()) layer.options.emplace(option.name, option.standard);
  EXPECT_EQ(complaint(layer), "");
  EXPECT_EQ(resolve(std::vector{layer}).policy, default_policy());
  EXPECT_EQ(resolve({}).policy, default_policy());
}

TEST(PolicyResolve, UnitsAreTakenAsWritten) {
  const std::vector<PolicyLayer> layers = {
      {"srpt", {{"scope", "packet"}, {"quantum", "250"}, {"aging", "30"}, {"slots", "auto"}, {"uplink", "2048"}}}};
  const Policy policy = resolve(layers).policy;
  EXPECT_EQ(policy.rule, "srpt");
  EXPECT_EQ(policy.rule_options, (RuleOptions{{"scope", "packet"}}));
  EXPECT_EQ(policy.quantum, milliseconds(250));
  EXPECT_EQ(policy.aging, seconds(30));
  EXPECT_EQ(policy.slots, std::nullopt);
  EXPECT_EQ(policy.uplink, 256'000);
}

TEST(PolicyResolve, RuleWithItsOptionsOfTheFirstThatNamesOne) {
  const std::vector<PolicyLayer> layers = {
      common("slots", "3"),
      {"srpt", {{"quantum", "10"}}},
      {"fcsf", {{"burst", "2"}, {"quantum", "20"}, {"aging", "5"}, {"slots", "7"}}},
  };
  const Resolved resolved = resolve(layers);
  EXPECT_EQ(resolved.policy.rule, "srpt");
  EXPECT_TRUE(resolved.policy.rule_options.empty()) << "burst is not srpt's";
  EXPECT_EQ(resolved.rule_from, 1U);
  EXPECT_EQ(resolved.policy.slots, 3U);
  EXPECT_EQ(resolved.from.at("slots"), 0U);
  EXPECT_EQ(resolved.policy.quantum, milliseconds(10));
  EXPECT_EQ(resolved.from.at("quantum"), 1U);
  EXPECT_EQ(resolved.policy.aging, seconds(5));
  EXPECT_EQ(resolved.from.at("aging"), 2U);
  EXPECT_EQ(resolved.from.at("uplink"), std::nullopt);
  EXPECT_EQ(resolved.from.size(), common_options().size());
}

TEST(PolicyResolve, AWeakerLayerOfTheSameRuleLendsItNoOptions) {
  const Resolved resolved = resolve(std::vector<PolicyLayer>{{"fcsf", {}}, {"fcsf", {{"burst", "2"}}}});
  EXPECT_TRUE(resolved.policy.rule_options.empty());
  EXPECT_EQ(resolved.rule_from, 0U);
}

TEST(PolicyResolve, AStrongZeroSwitchesAWeakOptionOff) {
  const Resolved resolved = resolve(std::vector<PolicyLayer>{common("quantum", "0"), common("quantum", "50")});
  EXPECT_EQ(resolved.policy.quantum, std::nullopt);
  EXPECT_EQ(resolved.from.at("quantum"), 0U);
  const Resolved one = resolve(std::vector<PolicyLayer>{common("slots", "1"), common("slots", "auto")});
  EXPECT_EQ(one.policy.slots, 1U);
}

TEST(PolicyResolve, WhatIsSaidAlthoughItIsTheDefaultMakesNoOtherPolicy) {
  EXPECT_EQ(resolve(std::vector<PolicyLayer>{{"fcsf", {{"burst", "1"}}}}).policy,
            resolve(std::vector<PolicyLayer>{{"fcsf", {}}}).policy);
}

TEST(PolicyText, SaysAllThatCounts) {
  Policy policy = policy_of("fcsf", {{"burst", "2"}}, std::nullopt);
  policy.quantum = milliseconds(250);
  EXPECT_EQ(text_of(policy), "fcsf aging=0 burst=2 quantum=250 slots=auto uplink=0");
}

TEST(PolicyText, WrittenIsReadBackTheSame) {
  EXPECT_TRUE(rc::check("written() and resolve(), join and split", [] {
    Policy policy;
    policy.rule = *rc::gen::element<std::string>("fifo", "lcfs", "spf", "fcsf", "srpt", "fsp", "gain", "fair");
    if (policy.rule == "fcsf" && *rc::gen::arbitrary<bool>()) policy.rule_options["burst"] = "2";
    if (policy.rule == "srpt" && *rc::gen::arbitrary<bool>()) policy.rule_options["scope"] = "packet";
    if (*rc::gen::arbitrary<bool>()) policy.quantum = milliseconds(*rc::gen::inRange(1, 600'001));
    if (*rc::gen::arbitrary<bool>()) policy.aging = seconds(*rc::gen::inRange(1, 86'401));
    policy.slots = *rc::gen::inRange<std::size_t>(1, kMaxSlots + 1);
    if (*rc::gen::arbitrary<bool>()) policy.slots.reset();
    policy.uplink = 125.0 * *rc::gen::inRange(0, 100'000'001);
    const PolicyLayer layer = written(policy);
    RC_ASSERT(!check(layer));
    RC_ASSERT(resolve(std::vector{layer}).policy == policy);
    const std::string text = text_of(policy);
    const auto space = text.find(' ');
    RC_ASSERT(text.substr(0, space) == policy.rule);
    const auto options = split_options(text.substr(space + 1));
    RC_ASSERT(options.has_value());
    RC_ASSERT(*options == layer.options);
    RC_ASSERT(join_options(*options) == text.substr(space + 1));
  }));
}

TEST(PolicyText, SplitRefusesWhatIsNoOptions) {
  using Options = std::map<std::string, std::string, std::less<>>;
  EXPECT_EQ(split_options(""), Options{});
  EXPECT_EQ(split_options("a=1"), (Options{{"a", "1"}}));
  EXPECT_EQ(split_options("a=1 b="), (Options{{"a", "1"}, {"b", ""}}));
  EXPECT_EQ(split_options("a=b=c"), (Options{{"a", "b=c"}}));
  for (const char* text : {"a", "=1", " a=1", "a=1  b=2", "a=1 b", "a=1 a=2", "a=1 a=1", " ", "a=1 "}) {
    EXPECT_FALSE(split_options(text)) << "\"" << text << "\"";
  }
  EXPECT_EQ(join_options({}), "");
  EXPECT_EQ(join_options({{"b", "2"}, {"a", "1"}}), "a=1 b=2");
}

}  // namespace
}  // namespace pmcd::scheduler
