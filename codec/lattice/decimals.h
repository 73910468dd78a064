// SPDX-License-Identifier: MIT
// Decimal numbers of so many significant digits, numbered in the order of their values without gaps: as text files hold
// coordinates. Like floating point with a decimal exponent, denormals included: below 10^digits units the numbers are
// all multiples of the unit, above that each decade is ten times coarser than the one below. Zero has number 0 and -x
// the negated number of x. It knows nothing of floats; rounding to a float is the caller's.
#pragma once

#include <cstdint>

#include "codec/lattice/unit.h"

namespace pmcd::codec {

struct Decimals {
  Unit unit;
  unsigned digits = 0;  ///< significant ones; 0: any number, so these are all multiples of the unit

  friend bool operator==(const Decimals&, const Decimals&) = default;
};

inline constexpr unsigned kMaxDigits = 15;

/// Whether a stream may claim it: a valid unit, which must be a power of ten if the digits are limited.
bool valid(const Decimals& decimals);

/// The decimal with this number, as the nearest double. REQUIRES: valid(decimals), a number that first_from answers or
/// one between two such.
double value_of(const Decimals& decimals, std::int64_t number);

/// The number of the smallest decimal that is not below `value`, up to a rounding of value / unit; limited to what
/// the powers of ten reach. Never falls when the value grows. REQUIRES: valid(decimals).
std::int64_t first_from(const Decimals& decimals, double value);

}  // namespace pmcd::codec
