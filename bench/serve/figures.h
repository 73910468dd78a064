// SPDX-License-Identifier: MIT
// Figures that more than one load reports.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

namespace pmcd::bench {

/// CPU time of this process so far, user and system.
double seconds_of_cpu();

/// p50, p90, p99 and the most; sorts the argument.
nlohmann::json percentiles(std::vector<float>& latency_us);

}  // namespace pmcd::bench
