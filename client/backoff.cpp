// SPDX-License-Identifier: MIT
// Growing pauses.
#include "client/backoff.h"

#include <algorithm>
#include <cmath>

namespace pmcd::client {

using std::chrono::milliseconds;

void Backoff::progress(Time now) {
  progress_at_ = now;
  tries_ = 0;
}

std::optional<milliseconds> Backoff::failed(Time now) {
  ++tries_;
  if (tries_ > options_.most_tries) return std::nullopt;
  const double longest = static_cast<double>(options_.longest_pause.count());
  const double grown =
      static_cast<double>(options_.first_pause.count()) * std::pow(std::max(options_.factor, 1.0), tries_ - 1);
  const double share = std::uniform_real_distribution<double>(1 - std::clamp(options_.jitter, 0.0, 1.0), 1)(random_);
  milliseconds pause(static_cast<milliseconds::rep>(std::max(0.0, std::min(grown, longest) * share)));
  if (options_.give_up_after.count() == 0) return pause;
  const auto left = std::chrono::duration_cast<milliseconds>(progress_at_ + options_.give_up_after - now);
  if (left.count() <= 0) return std::nullopt;
  return std::min(pause, left);
}

}  // namespace pmcd::client
