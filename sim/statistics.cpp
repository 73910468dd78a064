// SPDX-License-Identifier: MIT
// Sorts and sums.
#include "sim/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace pmcd::sim {

Distribution distribution_of(std::vector<double> values) {
  if (values.empty()) return {0, kNever, kNever, kNever, kNever};
  std::sort(values.begin(), values.end());
  const auto at = [&values](double quantile) {
    const auto rank = static_cast<std::size_t>(std::ceil(quantile * static_cast<double>(values.size())));
    return values[std::max<std::size_t>(rank, 1) - 1];
  };
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {values.size(), sum / static_cast<double>(values.size()), at(0.5), at(0.95), at(0.99)};
}

double jain_index(const std::vector<double>& values) {
  double sum = 0;
  double squares = 0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  return squares > 0 ? sum * sum / (static_cast<double>(values.size()) * squares) : 1;
}

Summary summarize(const Scenario& scenario, const Outcome& outcome) {
  std::vector<double> first;
  std::vector<double> ten;
  std::vector<double> all;
  std::vector<double> served;
  for (const Fetch& fetch : outcome.fetches) {
    if (fetch.first_level >= 0) first.push_back(fetch.first_level);
    if (fetch.to_error[0] >= 0) ten.push_back(fetch.to_error[0]);
    if (fetch.complete < 0) continue;
    all.push_back(fetch.complete);
    served.push_back(best_time(scenario, fetch) / fetch.complete);
  }
  Summary summary;
  summary.fetches = outcome.fetches.size();
  summary.complete = all.size();
  summary.fairness = jain_index(served);
  summary.first_level = distribution_of(std::move(first));
  summary.to_ten_percent = distribution_of(std::move(ten));
  summary.all = distribution_of(std::move(all));
  return summary;
}

}  // namespace pmcd::sim
