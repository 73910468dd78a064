// SPDX-License-Identifier: MIT
#include "codec/lattice/unit.h"

#include <array>
#include <bit>

namespace pmcd::codec {
namespace {

constexpr std::array<double, kMaxPowerOfTen + 1> kPowers = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                            1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                            1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

double power_of_two(int exponent) {
  return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
}

}  // namespace

bool valid(const Unit& unit) {
  const std::int16_t most = unit.multiple == 0 ? kMaxPowerOfTwo : kMaxPowerOfTen;
  const bool known = unit.multiple <= 2 || unit.multiple == 5;
  return known && unit.exponent >= -most && unit.exponent <= most;
}

double power_of_ten(int exponent) {
  return kPowers[static_cast<std::size_t>(exponent)];
}

double multiple_of(const Unit& unit, std::int64_t k) {
  if (unit.multiple == 0) return static_cast<double>(k) * power_of_two(unit.exponent);
  const auto whole = static_cast<double>(k * unit.multiple);
  return unit.exponent < 0 ? whole / power_of_ten(-unit.exponent) : whole * power_of_ten(unit.exponent);
}

double in_units(const Unit& unit, double value) {
  if (unit.multiple == 0) return value * power_of_two(-unit.exponent);
  const double tens = unit.exponent < 0 ? value * power_of_ten(-unit.exponent) : value / power_of_ten(unit.exponent);
  return tens / unit.multiple;
}

}  // namespace pmcd::codec
