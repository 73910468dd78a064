// SPDX-License-Identifier: MIT
// What many fetches come to: quantiles of their times, and how evenly they were served. Numbers only.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sim/world.h"

namespace pmcd::sim {

struct Distribution {
  std::size_t count = 0;
  double mean = 0, median = 0, p95 = 0, p99 = 0;  ///< kNever if there are none
};

/// Quantiles are those of the value at rank ceil(q n). [O(n log n)]
Distribution distribution_of(std::vector<double> values);

/// Jain's index: 1 if all are equal, 1/n if one has everything; 1 of none.
double jain_index(const std::vector<double>& values);

struct Summary {
  std::size_t fetches = 0;
  std::size_t complete = 0;
  Distribution first_level;
  Distribution to_ten_percent;
  Distribution all;
  /// Jain's index of how much of its best possible speed each complete fetch got.
  double fairness = 1;
};
Summary summarize(const Scenario& scenario, const Outcome& outcome);

}  // namespace pmcd::sim
