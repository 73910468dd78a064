// SPDX-License-Identifier: MIT
// Models that do not start from nothing: a base mesh has too few symbols to learn from, so its models are fed with
// decisions of the expected kind before the first real one.
#pragma once

#include "codec/entropy/adaptive_bit.h"

namespace pmcd::codec {

/// `weight` decisions of which the share `ones` is 1, spread evenly. REQUIRES: 0 <= ones <= 1.
inline void prime(AdaptiveBit& model, double ones, unsigned weight) {
  double due = 0.5;
  for (unsigned i = 0; i < weight; ++i) {
    due += ones;
    const bool bit = due >= 1;
    if (bit) due -= 1;
    model.update(bit);
  }
}

}  // namespace pmcd::codec
