// SPDX-License-Identifier: MIT
// Names, values and layers of policies.
#include "daemon/scheduler/policy.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace pmcd::scheduler {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::int64_t kMaxQuantumMs = 600'000;
constexpr std::int64_t kMaxAgingS = 86'400;
constexpr std::int64_t kMaxUplinkKbit = 100'000'000;

constexpr std::array kCommon = {
    CommonOption{"aging", "seconds, 0 to 86400", "0",
                 "a request that is older goes before all that are not, the oldest first; 0: never"},
    CommonOption{"quantum", "milliseconds, 0 to 600000", "250",
                 "a transfer that has had its turn for so long is interrupted when another is to go; 0: never"},
    CommonOption{"slots", "1 to 1024, or auto", "auto", "transfers at the same time; auto: as many as fill the uplink"},
    CommonOption{"uplink", "kbit/s, 0 to 100000000", "0", "what the uplink carries; 0: measured"},
};

std::optional<std::int64_t> whole_number(std::string_view text, std::int64_t least, std::int64_t most) {
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size() || value < least || value > most) return std::nullopt;
  return value;
}

const CommonOption* find_common(std::string_view name) {
  const auto* const it =
      std::find_if(kCommon.begin(), kCommon.end(), [name](const CommonOption& option) { return option.name == name; });
  return it == kCommon.end() ? nullptr : it;
}

/// Puts a common option's value into the policy; false if it is none.
bool take_common(std::string_view name, std::string_view value, Policy& policy) {
  if (name == "slots" && value == "auto") {
    policy.slots.reset();
    return true;
  }
  const bool slots = name == "slots";
  const std::int64_t most = slots               ? static_cast<std::int64_t>(kMaxSlots)
                            : name == "quantum" ? kMaxQuantumMs
                            : name == "aging"   ? kMaxAgingS
                                                : kMaxUplinkKbit;
  const auto number = whole_number(value, slots ? 1 : 0, most);
  if (!number) return false;
  if (slots) {
    policy.slots = static_cast<std::size_t>(*number);
  } else if (name == "quantum") {
    policy.quantum = *number > 0 ? std::optional<Time>(milliseconds(*number)) : std::nullopt;
  } else if (name == "aging") {
    policy.aging = *number > 0 ? std::optional<Time>(seconds(*number)) : std::nullopt;
  } else {
    policy.uplink = static_cast<double>(*number) * 125;
  }
  return true;
}

std::string quoted(std::string_view text) {
  return "\"" + std::string(text) + "\"";
}

std::string listed(std::span<const std::string_view> words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

std::string rule_names() {
  std::string text;
  for (const RuleEntry& rule : all_rules()) text += (text.empty() ? "" : ", ") + std::string(rule.name);
  return text;
}

const RuleOption* find_option(const RuleEntry& rule, std::string_view name) {
  const auto it = std::find_if(rule.options.begin(), rule.options.end(),
                               [name](const RuleOption& option) { return option.name == name; });
  return it == rule.options.end() ? nullptr : &*it;
}

std::optional<PolicyError> check_option(const RuleEntry* rule, const std::string& name, const std::string& value) {
  if (const CommonOption* common = find_common(name)) {
    Policy ignored;
    if (take_common(name, value, ignored)) return std::nullopt;
    return PolicyError{"option " + name, quoted(value) + " is not " + std::string(common->value)};
  }
  const RuleOption* option = rule == nullptr ? nullptr : find_option(*rule, name);
  if (option == nullptr) {
    const auto has = [&name](const RuleEntry& entry) { return find_option(entry, name) != nullptr; };
    const auto owner = std::find_if(all_rules().begin(), all_rules().end(), has);
    if (owner == all_rules().end()) return PolicyError{"option " + name, "no rule has it"};
    return PolicyError{"option " + name, "is one of rule " + std::string(owner->name) +
                                             (rule == nullptr ? ", and no rule is given with it"
                                                              : ", not of rule " + std::string(rule->name))};
  }
  if (std::find(option->words.begin(), option->words.end(), value) == option->words.end()) {
    return PolicyError{"option " + name, quoted(value) + " is none of: " + listed(option->words)};
  }
  return std::nullopt;
}

}  // namespace

std::span<const CommonOption> common_options() {
  return kCommon;
}

std::optional<PolicyError> check(const PolicyLayer& layer) {
  const RuleEntry* rule = nullptr;
  if (layer.rule) {
    rule = find_rule(*layer.rule);
    if (rule == nullptr) return PolicyError{"rule", quoted(*layer.rule) + " is none of: " + rule_names(), true};
  }
  for (const auto& [name, value] : layer.options) {
    if (auto error = check_option(rule, name, value)) return error;
  }
  return std::nullopt;
}

Policy default_policy() {
  Policy policy;
  policy.rule = "gain";
  policy.rule_options = {{"until", "5"}};
  policy.quantum = milliseconds(250);
  policy.slots = std::nullopt;
  return policy;
}

Resolved resolve(std::span<const PolicyLayer> layers) {
  Resolved resolved;
  resolved.policy = default_policy();
  for (const CommonOption& option : kCommon) resolved.from.emplace(option.name, std::nullopt);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const PolicyLayer& layer = layers[i];
    const bool names_rule = layer.rule && !resolved.rule_from;
    if (names_rule) {
      resolved.policy.rule = *layer.rule;
      resolved.policy.rule_options.clear();
      resolved.rule_from = i;
    }
    for (const auto& [name, value] : layer.options) {
      if (const auto from = resolved.from.find(name); from != resolved.from.end()) {
        if (from->second) continue;
        from->second = i;
        take_common(name, value, resolved.policy);
      } else if (names_rule) {
        resolved.policy.rule_options[name] = value;
      }
    }
  }
  // What is said although it is the default makes no other policy.
  const RuleEntry* rule = find_rule(resolved.policy.rule);
  std::erase_if(resolved.policy.rule_options,
                [rule](const auto& given) { return find_option(*rule, given.first)->words.front() == given.second; });
  return resolved;
}

PolicyLayer written(const Policy& policy) {
  PolicyLayer layer{policy.rule, all_options(policy.rule, policy.rule_options)};
  const auto count = [](auto duration) { return std::to_string(duration.count()); };
  layer.options["slots"] = policy.slots ? std::to_string(*policy.slots) : "auto";
  layer.options["quantum"] = policy.quantum ? count(std::chrono::duration_cast<milliseconds>(*policy.quantum)) : "0";
  layer.options["aging"] = policy.aging ? count(std::chrono::duration_cast<seconds>(*policy.aging)) : "0";
  layer.options["uplink"] = std::to_string(std::llround(policy.uplink / 125));
  return layer;
}

std::string text_of(const Policy& policy) {
  const PolicyLayer layer = written(policy);
  return *layer.rule + " " + join_options(layer.options);
}

std::string join_options(const std::map<std::string, std::string, std::less<>>& options) {
  std::string text;
  for (const auto& [name, value] : options) {
    if (!text.empty()) text += ' ';
    text.append(name).append("=").append(value);
  }
  return text;
}

std::optional<std::map<std::string, std::string, std::less<>>> split_options(std::string_view text) {
  std::map<std::string, std::string, std::less<>> options;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    if (word.size() + 1 == text.size()) return std::nullopt;  // a blank, and nothing behind it
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos || equals == 0) return std::nullopt;
    if (!options.emplace(word.substr(0, equals), word.substr(equals + 1)).second) return std::nullopt;
  }
  return options;
}

}  // namespace pmcd::scheduler
