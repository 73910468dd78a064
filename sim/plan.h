// SPDX-License-Identifier: MIT
// A plan: a file that says who comes when, over which line, and fetches what, instead of a seed that draws it. Read
// here; nothing runs.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "sim/problem.h"
#include "sim/scenario.h"

namespace pmcd::sim {

/// An option of the command line, and the field of a plan that says the same.
struct PlanOption {
  const char* option;
  const char* field;
};

/// Replaces the lines and clients of `scenario`, and of its uplink, meshes and open requests what the plan has. A JSON
/// object:
///   "lines":   array of {"name", "down_kbit", "up_kbit", "rtt_ms", and optional "queue_bytes"}
///   "clients": array of {"line": name, "mesh": name or "meshes": names, and optional "arrives" (seconds),
///              "stalls_after" or "leaves_after" (a packet of its first mesh),
///              "joins_after" (seconds from its arrival until it can ask; simulated where it is missing)}
///   optional "uplink_kbit", "uplink_queue_bytes", "open", "meshes" (as `pmcctl show --json` prints them, in an array)
/// A field that means nothing is refused, and one that the command line says, too. `given`: options whose values
/// `scenario` has because they were given. `from` names the plan in errors.
Result<Scenario> parse_plan(std::string_view text, const std::string& from, Scenario scenario,
                            std::span<const PlanOption> given);
/// The same of a file.
Result<Scenario> read_plan(const std::string& path, Scenario scenario, std::span<const PlanOption> given);

}  // namespace pmcd::sim
