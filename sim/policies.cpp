// SPDX-License-Identifier: MIT
// Sorts options to the rules that have them; what they mean and what is wrong with them, the scheduler says.
#include "sim/policies.h"

#include <algorithm>
#include <array>

namespace pmcd::sim {
namespace {

using scheduler::PolicyLayer;

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

}  // namespace

Result<std::vector<scheduler::Policy>> read_policies(const std::vector<std::string>& rules,
                                                     const std::vector<std::string>& options) {
  std::vector<std::string> names;
  for (const std::string& rule : rules) {
    if (rule != "all") {
      names.push_back(rule);
      continue;
    }
    for (const scheduler::RuleEntry& entry : scheduler::all_rules()) names.emplace_back(entry.name);
  }
  decltype(PolicyLayer::options) given;
  for (const std::string& option : options) {
    const auto equals = option.find('=');
    if (equals == std::string::npos || equals == 0) return Problem{"option \"" + option + "\" is not NAME=VALUE"};
    if (!given.emplace(option.substr(0, equals), option.substr(equals + 1)).second) {
      return Problem{"option " + option.substr(0, equals) + " is given twice"};
    }
  }
  std::vector<scheduler::Policy> policies;
  for (const std::string& name : names) {
    PolicyLayer layer{name, {}};
    for (const auto& entry : given) {
      const std::string& option = entry.first;
      const bool others = is_of_some_rule(option) && !rule_has(name, option) &&
                          std::any_of(names.begin(), names.end(),
                                      [&option](const std::string& rule) { return rule_has(rule, option); });
      if (!others) layer.options.insert(entry);
    }
    if (const auto error = scheduler::check(layer)) return Problem{error->sentence()};
    policies.push_back(scheduler::resolve(std::array{layer}).policy);
  }
  return policies;
}

}  // namespace pmcd::sim
