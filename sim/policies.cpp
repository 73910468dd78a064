// SPDX-License-Identifier: MIT
// Sorts options to the rules that have them; what they mean and what is wrong with them, the scheduler says.
#include "sim/policies.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace pmcd::sim {
namespace {

using scheduler::PolicyLayer;
using Options = decltype(PolicyLayer::options);

/// A rule that is asked for, and the options that it alone is given.
struct AskedRule {
  std::string name;
  Options options;
};

bool rule_has(const std::string& rule, std::string_view option) {
  const scheduler::RuleEntry* entry = scheduler::find_rule(rule);
  return entry != nullptr && std::any_of(entry->options.begin(), entry->options.end(),
                                         [option](const auto& own) { return own.name == option; });
}

bool is_of_some_rule(std::string_view option) {
  const auto rules = scheduler::all_rules();
  return std::any_of(rules.begin(), rules.end(),
                     [option](const auto& rule) { return rule_has(std::string(rule.name), option); });
}

bool is_common(std::string_view option) {
  const auto common = scheduler::common_options();
  return std::any_of(common.begin(), common.end(), [option](const auto& one) { return one.name == option; });
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") + 1 - first);
}

Problem given_twice(const std::string& option) {
  return wrong_usage("option " + option + " is given twice");
}

/// Puts "NAME=VALUE" to the others; or says what is wrong with it.
std::optional<Problem> add_option(std::string_view text, Options& options) {
  const auto equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    return wrong_usage("option \"" + std::string(text) + "\" is not NAME=VALUE");
  }
  const std::string name(text.substr(0, equals));
  if (!options.emplace(name, text.substr(equals + 1)).second) return given_twice(name);
  return std::nullopt;
}

/// One item of --rules, which is a rule or "all".
Result<std::vector<AskedRule>> asked_rules(std::string_view text) {
  AskedRule asked;
  std::string_view rest = trimmed(text);
  const std::string whole(rest);
  asked.name = rest.substr(0, rest.find('+'));
  rest.remove_prefix(asked.name.size());
  if (asked.name == "all") {
    if (!rest.empty()) return wrong_usage("rule \"" + whole + "\": all is every rule, and has no options of its own");
    std::vector<AskedRule> all;
    for (const scheduler::RuleEntry& entry : scheduler::all_rules()) all.push_back({std::string(entry.name), {}});
    return all;
  }
  while (!rest.empty()) {
    rest.remove_prefix(1);
    const std::string_view option = rest.substr(0, rest.find('+'));
    rest.remove_prefix(option.size());
    if (auto problem = add_option(option, asked.options)) return *std::move(problem);
  }
  const auto common = std::find_if(asked.options.begin(), asked.options.end(),
                                   [](const auto& option) { return is_common(option.first); });
  if (common != asked.options.end()) {
    const auto& [name, value] = *common;
    return wrong_usage("option " + name + ": is one of every rule, not of rule " + asked.name + " alone; --option " +
                       name + "=" + value + " gives it to all");
  }
  return std::vector{std::move(asked)};
}

}  // namespace

Result<std::vector<scheduler::Policy>> read_policies(const std::vector<std::string>& rules,
                                                     const std::vector<std::string>& options) {
  std::vector<AskedRule> asked;
  for (const std::string& text : rules) {
    auto these = asked_rules(text);
    if (const Problem* problem = problem_of(these)) return *problem;
    for (AskedRule& rule : std::get<std::vector<AskedRule>>(these)) asked.push_back(std::move(rule));
  }
  Options given;
  for (const std::string& option : options) {
    if (auto problem = add_option(option, given)) return *std::move(problem);
  }
  std::vector<scheduler::Policy> policies;
  for (const AskedRule& rule : asked) {
    PolicyLayer layer{rule.name, rule.options};
    for (const auto& entry : given) {
      const std::string& option = entry.first;
      const bool others = is_of_some_rule(option) && !rule_has(rule.name, option) &&
                          std::any_of(asked.begin(), asked.end(),
                                      [&option](const auto& other) { return rule_has(other.name, option); });
      if (!others && !layer.options.insert(entry).second) return given_twice(option);
    }
    if (const auto error = scheduler::check(layer)) return wrong_usage(error->sentence());
    policies.push_back(scheduler::resolve(std::array{layer}).policy);
  }
  return policies;
}

std::string rule_text(const scheduler::Policy& policy) {
  std::string text = policy.rule;
  for (const auto& [name, value] : policy.rule_options) text.append("+").append(name).append("=").append(value);
  return text;
}

}  // namespace pmcd::sim
