// SPDX-License-Identifier: MIT
// Which passes make a packet: passes are grouped so that each level has about twice the vertices of the one before, or
// so that at most a wanted number of packets comes out. It looks at counts only.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace pmcd::codec {

/// How much levels grow, unless a number of packets is wanted.
struct Growth {
  double usual = 1.75;  ///< at least; one pass takes out a quarter to a third, so two passes grow 1.8 to 2.2 times
  double most = 3.0;    ///< no level grows by more, unless a single pass does
  /// The finest level holds most of the bytes and gains most from seeing much connectivity first: three passes.
  double last = 2.2;
  double last_most = 3.0;
};

/// `vertices_after[k]` is the vertex count once pass k (coarse to fine) is applied, `base_vertices` before any; both
/// rise strictly. Answers for each packet how many passes it takes, in order; the sum is vertices_after.size().
/// With `most_packets` (>= 1) no more than that many.
std::vector<std::uint32_t> group_passes(std::uint32_t base_vertices, std::span<const std::uint32_t> vertices_after,
                                        std::optional<unsigned> most_packets, const Growth& growth = {});

}  // namespace pmcd::codec
