// SPDX-License-Identifier: MIT
// A broken invariant ends the program: that is what a fuzzer notices, whatever the build type.
#pragma once

#include <string>

namespace pmcd::fuzz {

/// Says what is broken on stderr and aborts.
[[noreturn]] void broken(const std::string& what);

inline void check(bool holds, const char* what) {
  if (!holds) broken(what);
}

}  // namespace pmcd::fuzz
