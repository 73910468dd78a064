// SPDX-License-Identifier: MIT
#include "codec/lattice/decimals.h"

namespace pmcd::codec {
namespace {

// 10^digits, and how many numbers a decade above that has.
struct Decades {
  explicit Decades(unsigned digits)
      : limit(static_cast<std::int64_t>(power_of_ten(static_cast<int>(digits)))), each(limit - limit / 10) {}
  std::int64_t limit;
  std::int64_t each;
};

// The number of a decimal next to a magnitude: above it or below it.
std::int64_t magnitude_number(const Decimals& decimals, double magnitude, bool above) {
  auto whole = [&](double x) { return above ? whole_above(x) : whole_below(x); };
  double x = in_units(decimals.unit, magnitude);
  if (decimals.digits == 0) return whole(x);
  const Decades decades(decimals.digits);
  const auto limit = static_cast<double>(decades.limit);
  if (x < limit) return whole(x);
  Unit unit = decimals.unit;
  std::int64_t decade = 0;
  while (x >= limit && unit.exponent < kMaxPowerOfTen) {
    ++unit.exponent;
    ++decade;
    x = in_units(unit, magnitude);
  }
  std::int64_t k = whole(x < limit ? x : limit);
  // A quotient that fell below the decade by a rounding.
  if (k < decades.limit / 10) k = decades.limit / 10;
  return decades.limit + (decade - 1) * decades.each + (k - decades.limit / 10);
}

}  // namespace

bool valid(const Decimals& decimals) {
  return valid(decimals.unit) && decimals.digits <= kMaxDigits && (decimals.digits == 0 || decimals.unit.multiple == 1);
}

double value_of(const Decimals& decimals, std::int64_t number) {
  if (decimals.digits == 0) return multiple_of(decimals.unit, number);
  const Decades decades(decimals.digits);
  const std::int64_t magnitude = number < 0 ? -number : number;
  if (magnitude < decades.limit) return multiple_of(decimals.unit, number);
  Unit unit = decimals.unit;
  std::int64_t k = magnitude - decades.limit;
  const std::int64_t decade = k / decades.each;
  k = k % decades.each + decades.limit / 10;
  std::int64_t exponent = unit.exponent + decade + 1;
  if (exponent > kMaxPowerOfTen) {  // only one past the last decade, which is ten times its first
    exponent = kMaxPowerOfTen;
    k *= 10;
  }
  unit.exponent = static_cast<std::int16_t>(exponent);
  return multiple_of(unit, number < 0 ? -k : k);
}

std::int64_t first_from(const Decimals& decimals, double value) {
  return value >= 0 ? magnitude_number(decimals, value, true) : -magnitude_number(decimals, -value, false);
}

}  // namespace pmcd::codec
