// SPDX-License-Identifier: MIT
// The entries of the retriangulation table (triangulation.h), for code that is compiled once for each of their shapes.
#pragma once

#include "codec/conquest/triangulation.h"

namespace pmcd::codec {

inline constexpr Tag kP = Tag::plus;
inline constexpr Tag kM = Tag::minus;
using Corners = std::array<std::array<std::uint8_t, 3>, 4>;
using Tags = std::array<Tag, kMaxPatchSize>;

// Corners in, adjacency out: everything that a walk over the polygon needs is derived here, once, at compile time.
constexpr Triangulation make_triangulation(std::uint8_t shape, std::uint8_t size, const Corners& corners,
                                           const Tags& tags) {
  Triangulation t;
  t.shape = shape;
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

inline constexpr Triangulation kThreePlus = make_triangulation(0, 3, {{{0, 1, 2}}}, {kP, kP, kP});
inline constexpr Triangulation kThreeMinus = make_triangulation(0, 3, {{{0, 1, 2}}}, {kP, kM, kP});
inline constexpr Triangulation kFourS =
    make_triangulation(1, 4, {{{0, 1, 3}, {1, 2, 3}}}, {kP, kP, kM, kP});  // diagonal v1-s
inline constexpr Triangulation kFourT =
    make_triangulation(2, 4, {{{0, 1, 2}, {0, 2, 3}}}, {kP, kM, kP, kP});  // diagonal t-v2
inline constexpr Triangulation kFiveS =
    make_triangulation(3, 5, {{{0, 1, 4}, {1, 3, 4}, {1, 2, 3}}}, {kP, kP, kM, kP, kP});
inline constexpr Triangulation kFiveT =
    make_triangulation(4, 5, {{{0, 3, 4}, {0, 1, 3}, {1, 2, 3}}}, {kP, kP, kM, kP, kP});
inline constexpr Triangulation kFiveBoth =
    make_triangulation(5, 5, {{{0, 1, 2}, {0, 2, 4}, {2, 3, 4}}}, {kP, kM, kP, kM, kP});
inline constexpr Triangulation kSixS =
    make_triangulation(6, 6, {{{0, 1, 5}, {1, 2, 3}, {3, 4, 5}, {1, 3, 5}}}, {kP, kP, kM, kP, kM, kP});
inline constexpr Triangulation kSixT =
    make_triangulation(7, 6, {{{0, 1, 2}, {2, 3, 4}, {0, 4, 5}, {0, 2, 4}}}, {kP, kM, kP, kM, kP, kP});

// Border patches have the same triangles; their tags are minus, plus at the ends of the diagonal, plus all over when
// there is none.
inline constexpr Triangulation kBorderThree = make_triangulation(0, 3, {{{0, 1, 2}}}, {kP, kP, kP});
inline constexpr Triangulation kBorderFourS = make_triangulation(1, 4, {{{0, 1, 3}, {1, 2, 3}}}, {kM, kP, kM, kP});
inline constexpr Triangulation kBorderFourT = make_triangulation(2, 4, {{{0, 1, 2}, {0, 2, 3}}}, {kP, kM, kP, kM});

static_assert(kSixS.step[1].from_triangle == 0 && kSixS.corner[1][2] == 5, "the middle triangle follows the gate's");

/// One triangulation of each shape, by Triangulation::shape.
inline constexpr std::array<const Triangulation*, 8> kShapes = {&kThreePlus, &kFourS,    &kFourT, &kFiveS,
                                                                &kFiveT,     &kFiveBoth, &kSixS,  &kSixT};

}  // namespace pmcd::codec
