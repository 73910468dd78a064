// SPDX-License-Identifier: MIT
// Runs as tables for people and as JSON for programs. It measures nothing.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "sim/statistics.h"

namespace pmcd::sim {

struct Run {
  scheduler::Policy policy;
  Outcome outcome;
};

/// A title for people, which says what the link carries: no policy says that.
std::string whole_title(const std::string& title, const Scenario& scenario);
/// That, and what a policy's "uplink" is.
void print_heading(std::ostream& out, const std::string& title, const Scenario& scenario);
/// Rules beside each other: times in seconds, link use, fairness.
void print_summaries(std::ostream& out, const Scenario& scenario, const std::vector<Run>& runs);
/// A row for each fetch of a run, with its times in seconds; "-" for what never came.
void print_clients(std::ostream& out, const Scenario& scenario, const Run& run);

/// The same and the scenario as one JSON document, times in seconds rounded to microseconds, null for what never came.
/// A rule stands there as rule_text() writes it. `title` says what was simulated; `clients`: with a row for each fetch.
std::string json_of(const std::string& title, const Scenario& scenario, const std::vector<Run>& runs, bool clients);

}  // namespace pmcd::sim
