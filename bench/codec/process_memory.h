// SPDX-License-Identifier: MIT
// How much memory one piece of work needs at its peak, as the kernel counts resident pages of this process. Linux only;
// nothing else in the process may allocate meanwhile.
#pragma once

#include <cstdint>

namespace pmcd::bench {

/// Starts at construction: gives free memory back to the kernel, notes what is resident and resets the peak.
class PeakMemory {
 public:
  PeakMemory();

  /// Bytes that were resident at the peak since construction, above what was resident then.
  [[nodiscard]] std::uint64_t growth_bytes() const;

 private:
  std::uint64_t before_bytes_ = 0;
};

}  // namespace pmcd::bench
