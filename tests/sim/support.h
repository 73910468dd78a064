// SPDX-License-Identifier: MIT
// Short ways to policies and scenarios. It asserts what it was given.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim/policies.h"
#include "sim/scenario.h"
#include "sim/world.h"

namespace pmcd::sim {

inline scheduler::Policy policy(const std::string& rule, const std::vector<std::string>& options = {}) {
  const auto read = read_policies({rule}, options);
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
