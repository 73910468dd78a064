// SPDX-License-Identifier: MIT
#include "codec/conquest/triangulation.h"

#include "codec/conquest/triangulation_table.h"

namespace pmcd::codec {

const Triangulation& interior_triangulation(unsigned size, Tag tag_s, Tag tag_t) {
  const bool both_plus = tag_s == kP && tag_t == kP;
  const bool s_shrinks = tag_s == kM && tag_t == kP;
  switch (size) {
    case 3:
      return both_plus ? kThreeMinus : kThreePlus;
    case 4:
      return both_plus || s_shrinks ? kFourT : kFourS;
    case 5:
      return both_plus ? kFiveBoth : (s_shrinks ? kFiveT : kFiveS);
    default:
      return both_plus || s_shrinks ? kSixT : kSixS;
  }
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
