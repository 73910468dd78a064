// SPDX-License-Identifier: MIT
// How long to pause before the next try after a lost line, and when to give up. Has no clock and sleeps not.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <random>

namespace pmcd::client {

struct RetryOptions {
  std::chrono::milliseconds first_pause{500};
  double factor = 2;  ///< each further pause is so many times the one before
  std::chrono::milliseconds longest_pause{30'000};
  /// Each pause is drawn from (1 - jitter) to 1 times its length, so that clients that were lost together do not come
  /// back together. 0 to 1.
  double jitter = 0.25;
  /// Tries in a row that may fail without a byte before the next failure is final; 0: none, no failure is forgiven.
  std::uint32_t most_tries = 10;
  static constexpr std::uint32_t kAnyNumber = 0xffffffff;
  /// Time without a byte after which no new try begins; 0: for ever. A try that runs ends by its own time-outs.
  std::chrono::milliseconds give_up_after{0};
};

class Backoff {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// `now`: when the waiting for the first byte begins. `seed`: of the jitter.
  Backoff(const RetryOptions& options, Time now, std::uint32_t seed)
      : options_(options), progress_at_(now), random_(seed) {}

  /// Bytes have come: the next pause is the first one again.
  void progress(Time now);

  /// A try has failed: the pause before the next one, or nullopt to give up. The last pause is cut so that the last try
  /// begins when the time is over.
  std::optional<std::chrono::milliseconds> failed(Time now);

  /// Tries in a row that have failed.
  [[nodiscard]] std::uint32_t tries() const { return tries_; }

 private:
  RetryOptions options_;
  Time progress_at_;
  std::uint32_t tries_ = 0;
  std::minstd_rand random_;
};

}  // namespace pmcd::client
