// SPDX-License-Identifier: MIT
#include "codec/lattice/unit.h"

namespace pmcd::codec {

bool valid(const Unit& unit) {
  const std::int16_t most = unit.multiple == 0 ? kMaxPowerOfTwo : kMaxPowerOfTen;
  const bool known = unit.multiple <= 2 || unit.multiple == 5;
  return known && unit.exponent >= -most && unit.exponent <= most;
}

}  // namespace pmcd::codec
