// SPDX-License-Identifier: MIT
// What a stream has its decoder spend time on, for the sake of bits, and what each effort chooses.
#pragma once

#include <cstddef>
#include <cstdint>

#include "codec/encoder.h"
#include "codec/encoder/precision.h"
#include "codec/geometry/structure.h"
#include "codec/source.h"

namespace pmcd::codec {

struct Spending {
  Guessing guessing = Guessing::never;
  std::uint32_t clear = 0;  ///< sevenths, up to kNoneClear
  Structure structure = Structure::none;
};

/// For a mesh of so many vertices. The standard effort spends on nothing but values of meshes that consist of planes;
/// best effort spends on all, on meshes that take long to decode a little less.
inline Spending plan_spending(Effort effort, Alignment alignment, std::size_t vertices) {
  if (effort == Effort::standard) {
    return {Guessing::never, 0, alignment == Alignment::planes ? Structure::values : Structure::none};
  }
  constexpr std::size_t kLarge = 100'000;
  return {Guessing::often, vertices > kLarge ? 4 : kNoneClear,
          alignment == Alignment::none ? Structure::none : Structure::all};
}

}  // namespace pmcd::codec
