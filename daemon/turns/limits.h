// SPDX-License-Identifier: MIT
// How large chunks are and how long a client may take nothing. Values only.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace pmcd::turns {

struct Limits {
  std::size_t least_chunk_bytes = 512;
  std::size_t first_chunk_bytes = 4 * 1024;  ///< to a client whose speed is not known yet
  std::size_t most_chunk_bytes = 64 * 1024;
  double chunk_seconds = 0.1;  ///< so much of a client's speed is a chunk, within those bounds

  std::chrono::milliseconds stall{10'000};        ///< a running transfer, or an answer, without a byte of progress
  std::uint64_t min_rate = 500;                   ///< bytes a second that a running transfer has to bring on, 0: none
  std::chrono::milliseconds rate_window{30'000};  ///< over which min_rate is judged
};

}  // namespace pmcd::turns
