// SPDX-License-Identifier: MIT
// How much memory the program's operator new has given out: what hostile packets may make a decoder allocate. Link
// allocations.cpp and every new in the program is counted. One thread only.
#pragma once

#include <cstddef>

namespace pmcd::codec::testing {

/// Counts from its construction on.
class AllocationMeter {
 public:
  AllocationMeter();
  /// The most bytes that were alive at once, beyond those alive at the start.
  [[nodiscard]] std::size_t peak() const;

 private:
  std::size_t at_start_;
};

}  // namespace pmcd::codec::testing
