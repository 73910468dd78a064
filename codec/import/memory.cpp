// SPDX-License-Identifier: GPL-3.0-or-later
#include "codec/import/memory.h"

#include <malloc.h>

namespace pmcd::import {

void return_large_blocks() {
  constexpr int kLarge = 8 << 20;
  constexpr int kMostKept = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, kMostKept);
}

}  // namespace pmcd::import
