// SPDX-License-Identifier: MIT
#include "codec/conquest/triangulation.h"

#include "codec/conquest/triangulation_table.h"

namespace pmcd::codec {

const Triangulation& interior_triangulation(unsigned size, Tag tag_s, Tag tag_t) {
  // By size; both tags minus, s minus, t minus, both plus.
  static constexpr std::array<std::array<const Triangulation*, 4>, 4> kTable = {{
      {&kThreePlus, &kThreePlus, &kThreePlus, &kThreeMinus},
      {&kFourS, &kFourT, &kFourS, &kFourT},
      {&kFiveS, &kFiveT, &kFiveS, &kFiveBoth},
      {&kSixS, &kSixT, &kSixS, &kSixT},
  }};
  return *kTable[size - 3][(tag_s == kP ? 2u : 0u) + (tag_t == kP ? 1u : 0u)];
}

const Triangulation& border_triangulation(unsigned size, unsigned closing, Tag tag_t) {
  if (size == 3) return kBorderThree;
  // The diagonal a-m2 when the gate's tags are (+,-) or (-,-), else m1-b; a is the vertex after the closing edge.
  const bool from_a = tag_t == kM;
  const unsigned a = closing + 1;
  const bool a_is_odd = a % 2 == 1;  // the diagonal v1-s joins the odd ring numbers
  return a_is_odd == from_a ? kBorderFourS : kBorderFourT;
}

}  // namespace pmcd::codec
