// SPDX-License-Identifier: MIT
// What the features of faces and patches (face_view.cpp, hypothesis.cpp) are computed with: lengths of four vectors at
// a time, logarithms that are guarded, bounds, and what a decision makes of a vertex. Single precision in a fixed
// order: it steers decoding.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/entropy/softmax.h"
#include "codec/geometry/lanes.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec::features {

// Lengths and areas below this are none, lattice units.
inline constexpr float kLeast = 0.05f;
// An offset is not nearer to nothing than this share of an edge, squared.
inline constexpr float kLeastOffset = 0.003f;
inline constexpr float kFarthest = 4.0f;

inline Four at(const LatticePoint& p) {
  return Four{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), 0};
}

// |a|^2, |b|^2, |c|^2, |d|^2; the fourth lanes mean nothing.
inline Four squared(Four a, Four b, Four c, Four d) {
  const Four ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5);
  const Four cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5);
  const Four ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Four cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  const Four x = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  const Four y = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  const Four z = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  return x * x + y * y + z * z;
}

inline Four guarded_log2(Four x) {
  const Four least = Four{} + kLeast;
  return fast_log2(larger(x, least));
}

template <std::size_t kCount>
void set_bounded(Lanes<kCount>& inputs, const std::array<Four, kCount / 4>& fours) {
  for (std::size_t i = 0; i < fours.size(); ++i) {
    store_four(&inputs.value[4 * i], smaller(larger(fours[i], Four{} - kFarthest), Four{} + kFarthest));
  }
}

// What a decision makes of a vertex.
struct Outcome {
  std::uint8_t state = 0;     // Hypothesis::state
  std::int8_t deviation = 0;  // growth of |valence - 6|
};
inline constexpr unsigned kMostOpen = 7;  // above, all is alike
inline constexpr unsigned kMostValence = 15;
constexpr std::uint16_t brief_of(unsigned open, unsigned valence) {
  return static_cast<std::uint16_t>(std::min(open, kMostOpen) * (kMostValence + 1) + std::min(valence, kMostValence));
}
inline constexpr std::size_t kBriefs = (kMostOpen + 1) * (kMostValence + 1);
// By faces at it that are decided, at most 4, and faces that it gets for them, at most 2.
inline constexpr auto kOutcome = [] {
  std::array<std::array<Outcome, kBriefs>, 5 * 3> outcomes{};
  auto size = [](int x) { return x < 0 ? -x : x; };
  for (int decided = 0; decided < 5; ++decided) {
    for (int gets = 0; gets < 3; ++gets) {
      for (int open = 0; open <= static_cast<int>(kMostOpen); ++open) {
        for (int valence = 0; valence <= static_cast<int>(kMostValence); ++valence) {
          const int change = gets - decided;
          const int after = std::clamp(valence + change, 2, 11);
          outcomes[3 * static_cast<std::size_t>(decided) + static_cast<std::size_t>(gets)]
                  [brief_of(static_cast<unsigned>(open), static_cast<unsigned>(valence))] = {
                      static_cast<std::uint8_t>(std::clamp(open - decided, 0, 3) * 10 + after - 2),
                      static_cast<std::int8_t>(size(after - 6) - size(after - change - 6))};
        }
      }
    }
  }
  return outcomes;
}();

}  // namespace pmcd::codec::features
