// SPDX-License-Identifier: MIT
// A chart of runs: which part of all fetches was complete after how long, a curve for each rule. SVG as text; it writes
// no file.
#pragma once

#include <string>
#include <vector>

#include "sim/report.h"

namespace pmcd::sim {

/// A curve has at most some 200 corners. Time goes to where the slowest rule has 99 % of its fetches, or all if they
/// are few; what never came complete is missing from the top of its curve.
std::string chart_of(const std::string& title, const std::vector<Run>& runs);

}  // namespace pmcd::sim
