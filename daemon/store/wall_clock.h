// SPDX-License-Identifier: MIT
// The time of day as the tables hold it.
#pragma once

#include <chrono>
#include <cstdint>

namespace pmcd::store {

inline std::int64_t seconds_since_1970() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace pmcd::store
