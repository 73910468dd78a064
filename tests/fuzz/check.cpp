// SPDX-License-Identifier: MIT
#include "tests/fuzz/check.h"

#include <cstdio>
#include <cstdlib>

namespace pmcd::fuzz {

void broken(const std::string& what) {
  std::fprintf(stderr, "broken invariant: %s\n", what.c_str());
  std::abort();
}

}  // namespace pmcd::fuzz
