// SPDX-License-Identifier: MIT
#include "bench/serve/figures.h"

#include <sys/resource.h>

#include <algorithm>

namespace pmcd::bench {

double seconds_of_cpu() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

nlohmann::json percentiles(std::vector<float>& latency_us) {
  std::sort(latency_us.begin(), latency_us.end());
  const auto at = [&latency_us](double share) {
    return latency_us.empty()
               ? 0.0F
               : latency_us[static_cast<std::size_t>(share * static_cast<double>(latency_us.size() - 1))];
  };
  return {{"p50", at(0.5)}, {"p90", at(0.9)}, {"p99", at(0.99)}, {"most", at(1)}};
}

}  // namespace pmcd::bench
