// SPDX-License-Identifier: MIT
// Chance that is the same everywhere: a generator and the few distributions that the simulator draws from. The standard
// library's distributions differ from one library to the next, so none is used.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

namespace pmcd::sim {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// In [0, 1), 53 bits.
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  /// In [0, n). REQUIRES: n > 0; small beside 2^53, so that no value is favoured visibly.
  std::uint64_t below(std::uint64_t n) { return static_cast<std::uint64_t>(uniform() * static_cast<double>(n)); }
  /// The gap to the next of events that come `rate` times a second, in seconds, whole microseconds: the logarithm's
  /// last digit may differ between machines, and is rounded away.
  double gap(double rate) { return std::round(-std::log1p(-uniform()) / rate * 1e6) * 1e-6; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace pmcd::sim
