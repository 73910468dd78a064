// SPDX-License-Identifier: MIT
// What both commands take and give: rules, meshes, network, and where results go.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/problem.h"
#include "sim/report.h"

namespace pmcd::sim {

struct Arguments {
  std::vector<std::string> rules;
  std::vector<std::string> options;
  std::vector<std::string> lines;  ///< empty: the paper's
  std::string meshes;              ///< a file; empty: those that are built in
  std::string json;                ///< a file, "-" for standard output, empty: none
  std::string chart;               ///< a file; empty: none
  std::string network = "fluid";
  double uplink = 256;
  double scale = 1;
  double setup_round_trips = 4.5;
  double decode_rate = 0;  ///< kB a second
  double queue_ms = 100;
  double queue_packets = 10;
  double look_ms = 20;
  double late_ms = 0;
  double chunk_ms = 100;
  std::uint64_t seed = 1;
};

/// Adds those options. REQUIRES: `arguments` outlives the parsing.
void add_arguments(CLI::App& command, Arguments& arguments);

/// A scenario without clients.
Result<Scenario> scenario_of(const Arguments& arguments);

/// Simulates each policy.
std::vector<Run> simulate_all(const Scenario& scenario, const std::vector<scheduler::Policy>& policies);

/// Tables to standard output, or JSON if that goes there; JSON and chart to their files. `clients`: with a row for each
/// fetch. Returns the exit code; what is wrong goes to standard error.
int write_results(const Arguments& arguments, const std::string& title, const Scenario& scenario,
                  const std::vector<Run>& runs, bool clients);

/// Says what is wrong, and is the exit code for it.
int refuse(const Problem& problem);

}  // namespace pmcd::sim
