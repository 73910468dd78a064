// SPDX-License-Identifier: MIT
// Points and directions as three lanes of four floats (the fourth is 0): + - * / and sqrt only, in a fixed order, so
// that every IEEE build gives the same bits. Differences of lattice points are exact in it up to 2^24.
#pragma once

#include <cmath>

#include "codec/entropy/softmax.h"

namespace pmcd::codec {

inline float dot(Four a, Four b) {
  const Four product = a * b;
  return product[0] + product[1] + product[2];
}

inline float length(Four a) {
  return std::sqrt(dot(a, a));
}

inline Four cross(Four a, Four b) {
  const Four a_turned = __builtin_shufflevector(a, a, 1, 2, 0, 3);
  const Four b_turned = __builtin_shufflevector(b, b, 1, 2, 0, 3);
  const Four turned = a * b_turned - a_turned * b;
  return __builtin_shufflevector(turned, turned, 1, 2, 0, 3);
}

}  // namespace pmcd::codec
