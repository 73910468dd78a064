// SPDX-License-Identifier: MIT
// The distribution rules that exist, by name. A new rule is one file in rules/ and one line in registry.cpp.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

struct RuleEntry {
  std::string_view name;
  std::string_view summary;  ///< one line for people
  std::unique_ptr<Rule> (*make)();
};

/// All rules, sorted by name.
std::span<const RuleEntry> all_rules();

/// A fresh rule; null if no rule has this name.
std::unique_ptr<Rule> make_rule(std::string_view name);

}  // namespace pmcd::scheduler
