// SPDX-License-Identifier: GPL-3.0-or-later
#include "codec/import/memory.h"

#include <cstdlib>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace pmcd::import {

void return_large_blocks() {
#ifdef __GLIBC__
  constexpr int kLarge = 4 << 20;
  constexpr int kMostKept = 64 << 20;
  mallopt(M_MMAP_THRESHOLD, kLarge);
  mallopt(M_TRIM_THRESHOLD, kMostKept);
#endif
}

}  // namespace pmcd::import
