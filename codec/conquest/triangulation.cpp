// SPDX-License-Identifier: MIT
#include "codec/conquest/triangulation.h"

namespace pmcd::codec {
namespace {

constexpr Tag kP = Tag::plus;
constexpr Tag kM = Tag::minus;
using Corners = std::array<std::array<std::uint8_t, 3>, 4>;
using Tags = std::array<Tag, kMaxPatchSize>;

// Corners in, adjacency out: everything that a walk over the polygon needs is derived here, once, at compile time.
constexpr Triangulation make(std::uint8_t size, const Corners& corners, const Tags& tags) {
  Triangulation t;
  t.size = size;
  t.triangles = static_cast<std::uint8_t>(size - 2);
  t.tag = tags;
  // Order the triangles so that each lies across an edge of an earlier one, the gate's first.
  std::array<bool, 4> placed{};
  auto to = [](const std::array<std::uint8_t, 3>& c, unsigned e) { return c[(e + 1) % 3]; };
  for (std::uint8_t k = 0; k < t.triangles; ++k) {
    for (std::uint8_t i = 0; i < t.triangles; ++i) {
      if (placed[i]) continue;
      bool found = false;
      for (std::uint8_t e = 0; e < 3 && !found; ++e) {
        const std::uint8_t a = corners[i][e];
        const std::uint8_t b = to(corners[i], e);
        if (k == 0) {
          found = a == size - 1 && b == 0;
          if (found) t.step[0].entry_edge = e;
          continue;
        }
        for (std::uint8_t j = 0; j < k && !found; ++j) {
          for (std::uint8_t f = 0; f < 3 && !found; ++f) {
            found = t.corner[j][f] == b && to(t.corner[j], f) == a;
            if (found) t.step[k] = {j, f, e};
          }
        }
      }
      if (!found) continue;
      placed[i] = true;
      t.corner[k] = corners[i];
      for (std::uint8_t corner : corners[i]) ++t.faces_at[corner];
      if (k > 0) {
        const auto& from = t.corner[t.step[k].from_triangle];
        t.diagonal[k - 1u] = {from[t.step[k].from_edge], to(from, t.step[k].from_edge)};
      }
      break;
    }
    for (std::uint8_t e = 0; e < 3; ++e) {
      const std::uint8_t a = t.corner[k][e];
      t.ring_edge[k][e] = to(t.corner[k], e) == (a + 1) % size ? a : Triangulation::kDiagonal;
    }
  }
  for (std::uint8_t a = 0; a < size; ++a) {
    for (std::uint8_t b = 0; b < a; ++b) {
      bool together = false;
      for (std::uint8_t k = 0; k < t.triangles; ++k) {
        const auto& c = t.corner[k];
        together = together || ((c[0] == a || c[1] == a || c[2] == a) && (c[0] == b || c[1] == b || c[2] == b));
      }
      if (!together) t.apart[t.apart_count++] = {a, b};
    }
  }
  return t;
}

constexpr Triangulation kThreePlus = make(3, {{{0, 1, 2}}}, {kP, kP, kP});
constexpr Triangulation kThreeMinus = make(3, {{{0, 1, 2}}}, {kP, kM, kP});
constexpr Triangulation kFourS = make(4, {{{0, 1, 3}, {1, 2, 3}}}, {kP, kP, kM, kP});  // diagonal v1-s
constexpr Triangulation kFourT = make(4, {{{0, 1, 2}, {0, 2, 3}}}, {kP, kM, kP, kP});  // diagonal t-v2
constexpr Triangulation kFiveS = make(5, {{{0, 1, 4}, {1, 3, 4}, {1, 2, 3}}}, {kP, kP, kM, kP, kP});
constexpr Triangulation kFiveT = make(5, {{{0, 3, 4}, {0, 1, 3}, {1, 2, 3}}}, {kP, kP, kM, kP, kP});
constexpr Triangulation kFiveBoth = make(5, {{{0, 1, 2}, {0, 2, 4}, {2, 3, 4}}}, {kP, kM, kP, kM, kP});
constexpr Triangulation kSixS = make(6, {{{0, 1, 5}, {1, 2, 3}, {3, 4, 5}, {1, 3, 5}}}, {kP, kP, kM, kP, kM, kP});
constexpr Triangulation kSixT = make(6, {{{0, 1, 2}, {2, 3, 4}, {0, 4, 5}, {0, 2, 4}}}, {kP, kM, kP, kM, kP, kP});

// Border patches have the same triangles; their tags are minus, plus at the ends of the diagonal, plus all over when
// there is none.
constexpr Triangulation kBorderThree = make(3, {{{0, 1, 2}}}, {kP, kP, kP});
constexpr Triangulation kBorderFourS = make(4, {{{0, 1, 3}, {1, 2, 3}}}, {kM, kP, kM, kP});
constexpr Triangulation kBorderFourT = make(4, {{{0, 1, 2}, {0, 2, 3}}}, {kP, kM, kP, kM});

static_assert(kSixS.step[1].from_triangle == 0 && kSixS.corner[1][2] == 5, "the middle triangle follows the gate's");

}  // namespace

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
