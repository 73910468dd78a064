// SPDX-License-Identifier: MIT
// How often each value of one axis came so far, anywhere in the mesh: structured meshes have few of them.
// Gain at 12 bits, best effort: turbine 0.66, fandisk 0.27 bits a vertex.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "codec/entropy/softmax.h"

namespace pmcd::codec {

class ValueCounts {
 public:
  /// Counts are of cells of one size; with another all is forgotten.
  void begin(unsigned shift) {
    if (!counts_.empty() && shift == shift_) return;
    shift_ = shift;
    counts_.assign(kSlots + 3, 0);
  }
  void learn(std::int32_t value) {
    float& count = counts_[slot(value)];
    if (count < 255) ++count;
    if (slot(value) < 3) counts_[kSlots + slot(value)] = count;
  }

  /// Of the values around `centre`, no further than `reach` below and up to three more above, the one that came most
  /// for its distance; answers how often it came. [linear in the reach, of which 64 count]
  [[nodiscard]] std::size_t best_near(double centre, double reach, std::int32_t& value) const {
    const auto radius = static_cast<std::int32_t>(std::min(reach, 64.0));
    const double rounded = centre + 0.5;
    const auto middle = static_cast<std::int32_t>(rounded);
    value = middle;
    // Four values at a time; of equals the first.
    const float inverse = 1.0f / static_cast<float>(reach);
    const std::int32_t first = middle > radius ? middle - radius : 0;
    const auto offset = static_cast<float>(static_cast<double>(first) - centre);
    constexpr FourInts kLane{0, 1, 2, 3};
    Four best{};
    FourInts at{};
    for (std::int32_t step = 0; step <= middle + radius - first; step += 4) {
      const FourInts steps = kLane + step;
      const Four counts = load_four(&counts_[slot(first + step)]);
      const Four away = (__builtin_convertvector(steps, Four) + offset) * inverse;
      const Four score = counts / (0.1f + away * away);
      const FourInts better = score > best;
      best = better ? score : best;
      at = better ? steps : at;
    }
    int lane = 0;
    for (int other = 1; other < 4; ++other) {
      if (best[other] > best[lane] || (best[other] == best[lane] && at[other] < at[lane])) lane = other;
    }
    if (!(best[lane] > 0)) return 0;
    value = first + at[lane];
    return static_cast<std::size_t>(counts_[slot(value)]);
  }

 private:
  static constexpr std::size_t kSlots = 1 << 14;
  static std::size_t slot(std::int32_t value) { return static_cast<std::size_t>(value) & (kSlots - 1); }

  std::vector<float> counts_;  ///< by slot, whole; the first three once more at the end, so that four lie together
  unsigned shift_ = 0;
};

}  // namespace pmcd::codec
