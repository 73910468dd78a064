// SPDX-License-Identifier: MIT
// The distribution rules that exist, by name, with the options of each. A new rule is one file in rules/ and one line
// in registry.cpp.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// An option that only one rule has: one of a few words.
struct RuleOption {
  std::string_view name;
  std::span<const std::string_view> words;  ///< the first is what counts when nothing is said
  std::string_view summary;                 ///< one line for people
};

/// Options of a rule by name, each one of its words.
using RuleOptions = std::map<std::string, std::string, std::less<>>;

struct RuleEntry {
  std::string_view name;
  std::string_view summary;  ///< one line for people
  std::span<const RuleOption> options;
  /// REQUIRES: every option stands in `options`, and has one of its words.
  std::unique_ptr<Rule> (*make)(const RuleOptions& options, const Surroundings& surroundings);
  bool goes_by_weight = false;  ///< a client's weight changes its share
};

/// All rules: the paper's, then those of others and our own.
std::span<const RuleEntry> all_rules();

/// nullptr if no rule has this name.
const RuleEntry* find_rule(std::string_view name);

/// Every option that the rule has by itself, with the value that counts. `given`: as of make_rule(). REQUIRES: the rule
/// exists.
RuleOptions all_options(std::string_view rule, const RuleOptions& given);

/// A fresh rule. `given`: options that differ from their defaults. REQUIRES: the rule exists and has these options with
/// these words (Policy sees to that); `surroundings` outlives it.
std::unique_ptr<Rule> make_rule(std::string_view name, const RuleOptions& given, const Surroundings& surroundings);

}  // namespace pmcd::scheduler
