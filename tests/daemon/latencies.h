// SPDX-License-Identifier: MIT
// What something took, many times over.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace pmcd::test {

/// Times in ms, in ascending order.
struct Latencies {
  std::vector<double> sorted;

  explicit Latencies(std::vector<double> times) : sorted(std::move(times)) { std::sort(sorted.begin(), sorted.end()); }

  /// The time that a `share` (0 to 1) of all does not exceed.
  [[nodiscard]] double quantile(double share) const {
    if (sorted.empty()) return 0;
    const auto at = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
    return sorted[std::min(at, sorted.size() - 1)];
  }
};

}  // namespace pmcd::test
