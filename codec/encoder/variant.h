// SPDX-License-Identifier: MIT
// One variant of the stream: how passes become packets and how many digits each level has, and all packets written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "codec/encoder.h"
#include "codec/encoder/encoding_plan.h"
#include "codec/encoder/spending.h"
#include "codec/result.h"

namespace pmcd::codec {

struct Variant {
  std::vector<EncodedPacket> packets;
  std::vector<std::uint32_t> to_original;  ///< by decoder vertex
  BitReport bits;

  [[nodiscard]] std::size_t total_bytes() const {
    std::size_t sum = 0;
    for (const EncodedPacket& packet : packets) sum += packet.bytes.size();
    return sum;
  }
};

/// Told after each packet which share of the vertices is written; answers whether to go on.
using WritingProgress = std::function<bool(double share)>;

/// Whether another variant wants the passes of a descent; if not, each is freed once it is written.
enum class Passes : std::uint8_t { keep, use_up };

struct VariantOptions {
  Effort effort = Effort::standard;  ///< how passes become packets
  Spending spending;
  std::optional<unsigned> most_packets;  ///< after the base packet
};

/// Writes the mesh of `plan` by way of `descent`. Proves nothing. Errors: cancelled, and internal_error when the walk
/// up is not the walk down.
Result<Variant> write_variant(const EncodingPlan& plan, Descent& descent, Passes then, const VariantOptions& options,
                              const WritingProgress& progress);

}  // namespace pmcd::codec
