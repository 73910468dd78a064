// SPDX-License-Identifier: MIT
// Short ways to policies and scenarios. It asserts what it was given.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "sim/policies.h"
#include "sim/scenario.h"
#include "sim/world.h"

namespace pmcd::sim {

/// With one slot and no quantum, unless options say otherwise.
inline scheduler::Policy policy(const std::string& rule, const std::vector<std::string>& options = {}) {
  std::vector<std::string> all = options;
  for (const auto& [name, value] : {std::pair{"slots", "1"}, {"quantum", "0"}}) {
    const auto is_it = [name = std::string(name) + "="](const std::string& option) {
      return option.rfind(name, 0) == 0;
    };
    if (std::none_of(options.begin(), options.end(), is_it)) all.push_back(std::string(name) + "=" + value);
  }
  const auto read = read_policies({rule}, all);
  if (const Problem* problem = problem_of(read)) {
    ADD_FAILURE() << problem->text;
    return {};
  }
  return std::get<std::vector<scheduler::Policy>>(read).front();
}

/// The paper's network and the meshes that are built in, without clients.
inline Scenario paper_scenario() {
  Scenario scenario;
  scenario.lines = paper_lines();
  scenario.meshes = built_in_meshes();
  return scenario;
}

}  // namespace pmcd::sim
