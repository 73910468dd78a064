// SPDX-License-Identifier: MIT
// The table of rules. It holds no state: each call makes a fresh rule.
#include "daemon/scheduler/registry.h"

#include <array>

#include "daemon/scheduler/rules/fifo.h"

namespace pmcd::scheduler {

std::span<const RuleEntry> all_rules() {
  static constexpr std::array kRules = {
      RuleEntry{"fifo", "first in, first out: the request that has waited longest", &make_fifo},
  };
  return kRules;
}

std::unique_ptr<Rule> make_rule(std::string_view name) {
  for (const RuleEntry& entry : all_rules()) {
    if (entry.name == name) return entry.make();
  }
  return nullptr;
}

}  // namespace pmcd::scheduler
