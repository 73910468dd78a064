// SPDX-License-Identifier: MIT
// Coordinates as files hold them: multiples of a step, decimals of some significant digits. No function of libm that
// machines round differently.
#pragma once

#include <cmath>

namespace pmcd::fuzz {

/// The multiple of the step that is next to x. REQUIRES: step > 0.
inline double to_multiple(double x, double step) {
  return std::floor(x / step + 0.5) * step;
}

/// x to so many significant digits; what is very small or large stays as it is. REQUIRES: 1 <= digits <= 9.
inline double to_digits(double x, unsigned digits) {
  const double magnitude = std::abs(x);
  if (!(magnitude > 1e-12 && magnitude < 1e12)) return x;
  double least = 1;
  for (unsigned i = 1; i < digits; ++i) least *= 10;
  double power = 1;
  while (magnitude * power < least) power *= 10;
  return std::floor(x * power + 0.5) / power;
}

}  // namespace pmcd::fuzz
