// SPDX-License-Identifier: MIT
// The values that the coordinates of one vertex may repeat: what its ring suggests (repeats.h), where its image lies
// (reflection.h), what came often anywhere (value_counts.h). It says how much speaks for each; what that is worth is
// learnt (mixture.h).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "codec/geometry/coordinate_model.h"
#include "codec/geometry/reflection.h"
#include "codec/geometry/repeats.h"
#include "codec/geometry/structure.h"
#include "codec/geometry/value_counts.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

/// What the mesh repeats; encoder and decoder hold the same.
struct Repetition {
  Structure structure = Structure::none;
  std::array<ValueCounts, 3> values;  ///< by axis, if there is structure
  Reflection reflection;              ///< of the mesh onto itself, if any axis flips
  Images images;                      ///< of the vertices that are known

  [[nodiscard]] bool any() const { return structure != Structure::none || reflection.any(); }
};

class RepeatedValues {
 public:
  /// Where the vertex is expected: `mean` in cells, in the order of `axis`; `most`: the last cell; `shift`: digits that
  /// cells lack. All must outlive this object. REQUIRES: repetition.any().
  RepeatedValues(Repetition& repetition, const Surface& surface, const Ring& ring,
                 const std::array<std::size_t, 3>& axis, const std::array<double, 3>& mean, std::int32_t most,
                 unsigned shift)
      : repetition_(repetition), axis_(axis), mean_(mean), shift_(shift), reflects_(repetition.reflection.any()) {
    // Where both are looked for, images stand in for corners, which say little beside them.
    for (std::size_t kind = 0; kind < kRepeats; ++kind) {
      const bool is_image = reflects_ && kind == kImage;
      if (repetition.structure != Structure::all && !is_image) continue;
      repeated_[count_++].kind = kind;
      if (!is_image) most_often_[kind] = most_frequent(surface, ring, static_cast<Repeat>(kind), shift);
    }
    if (repetition.structure != Structure::none) repeated_[count_++].kind = kValue;
    if (!reflects_) return;
    LatticePoint about{};
    for (std::size_t i = 0; i < 3; ++i) {
      const double bounded = mean[i] > 0 ? std::min(mean[i], static_cast<double>(most)) : 0;
      about[axis[i]] = static_cast<std::int32_t>(bounded) << (shift + 1);
    }
    nearby_ = repetition.images.near(about);
  }

  /// For the i-th coordinate, which is expected at `centre` give or take `spread`; those before it are known (`cell`),
  /// the others give or take `tangential`. The answer holds until the next call.
  std::span<const RepeatedValue> expect(std::size_t i, double centre, double spread, const LatticePoint& cell,
                                        double tangential) {
    const auto spread_squared = static_cast<float>(spread * spread);
    for (std::size_t n = 0; n < count_; ++n) {
      RepeatedValue& repeated = repeated_[n];
      std::size_t times = 0;
      if (repeated.kind == kValue) {
        ValueCounts& values = repetition_.values[axis_[i]];
        values.begin(shift_);
        times = static_cast<std::size_t>(std::bit_width(values.best_near(centre, 3 * spread + 1, repeated.value)));
      } else if (reflects_ && repeated.kind == kImage) {
        repeated.value = 0;
        times = best_image(nearby_, axis_, i, cell, mean_, tangential, shift_, repeated.value);
      } else {
        const int lane = static_cast<int>(axis_[i]);
        times = static_cast<std::size_t>(most_often_[repeated.kind].times[lane]);
        repeated.value = most_often_[repeated.kind].value[lane];
      }
      const auto away = static_cast<float>(repeated.value - centre);
      const float square = away * away;
      // Hard to foresee, so there is no branch.
      const std::size_t far = (square >= 0.09f * spread_squared ? 1u : 0u) + (square >= spread_squared ? 1u : 0u) +
                              (square >= 6.25f * spread_squared ? 1u : 0u);
      repeated.context = (std::min<std::size_t>(times, 7) * 3 + outcome_[n]) * 4 + far;
    }
    return std::span(repeated_).first(count_);
  }

  /// The i-th coordinate came out as this.
  void learn(std::size_t i, std::int32_t value) {
    if (repetition_.structure != Structure::none) repetition_.values[axis_[i]].learn(value);
    for (std::size_t n = 0; n < count_; ++n) outcome_[n] = repeated_[n].value == value ? 1 : 2;
  }

 private:
  static constexpr auto kImage = static_cast<std::size_t>(Repeat::corner);
  static constexpr std::size_t kValue = kRepeats;
  static_assert(kValue < Mixture::kSpikes);

  Repetition& repetition_;
  const std::array<std::size_t, 3>& axis_;
  const std::array<double, 3>& mean_;
  unsigned shift_;
  bool reflects_;
  std::size_t count_ = 0;
  std::array<RepeatedValue, Mixture::kSpikes> repeated_;
  std::array<std::size_t, Mixture::kSpikes> outcome_{};  // of the values so far: 0 nothing yet, 1 hit, 2 not
  std::array<Repeated, kRepeats> most_often_;
  Images::Nearby nearby_;
};

}  // namespace pmcd::codec
