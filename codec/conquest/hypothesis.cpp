// SPDX-License-Identifier: MIT
// What stands before a gate, patch by patch. Steers decoding, as surroundings.cpp.
#include "codec/conquest/hypothesis.h"

#include <algorithm>

#include "codec/conquest/features.h"

namespace pmcd::codec {

using features::guarded_log2;
using features::kLeastOffset;
using features::kOutcome;
using features::Outcome;
using features::set_bounded;
using features::squared;

namespace {

float least_of(Four a) {
  return std::min(std::min(a[0], a[1]), std::min(a[2], a[3]));
}

float most_of(Four a) {
  return std::max(std::max(a[0], a[1]), std::max(a[2], a[3]));
}

// Factors by whether there is something to count.
constexpr std::array<Four, 2> kIfRefined = {Four{0, 0, 0, 0}, Four{1, 1, 1, 1}};

}  // namespace

template <unsigned kSize, bool kIsBorder>
void Surroundings::describe_patch(const HalfEdgeMesh& mesh, const Marks& marks, const Triangulation& triangulation,
                                  Hypothesis& h) const {
  const Scale& scale = scale_;
  static constexpr std::array<float, kMaxPatchSize + 1> kShare = {0,        1,        1 / 2.0f, 1 / 3.0f,
                                                                  1 / 4.0f, 1 / 5.0f, 1 / 6.0f};
  const Patch& patch = h.patch;
  constexpr unsigned kTriangles = kSize - 2;
  constexpr float kShareOfRing = 1.0f / static_cast<float>(kSize);

  float area = 0;
  float least_face = face_[patch.slots[0]].log_area;
  float most_face = least_face;
  for (unsigned k = 0; k < kTriangles; ++k) {
    const FaceShape& face = face_[patch.slots[k]];
    area += face.area;
    least_face = std::min(least_face, face.log_area);
    most_face = std::max(most_face, face.log_area);
  }

  std::array<Four, kMaxPatchSize> ring;
  Four mean{};
  int recent = 0;
  int regular = 0;
  for (unsigned i = 0; i < kSize; ++i) {
    const std::uint32_t v = patch.ring[i];
    ring[i] = vertex_[v].position;
    mean += ring[i];
    recent += v >= previous_ ? 1 : 0;
    const unsigned gets = kIsBorder ? static_cast<unsigned>(star_faces(patch, i)) : 2u;
    const Outcome after = kOutcome[3u * triangulation.faces_at[i] + gets][vertex_[v].brief];
    h.state[i] = after.state;
    regular += after.deviation;
  }
  mean *= kShareOfRing;

  // In two groups of four, the second empty or with its last vertex repeated.
  constexpr bool kIsLarge = kSize > 4;
  std::array<Four, 8> spoke;
  std::array<Four, 8> kite{};
  float border = 0;
  float longest = log_length(patch.inside[0]);
  float shortest = longest;
  unsigned kite_count = 0;
  for (unsigned i = 0; i < kSize; ++i) {
    spoke[i] = ring[i] - mean;
    const float edge = log_length(patch.inside[i]);
    border += edge;
    longest = std::max(longest, edge);
    shortest = std::min(shortest, edge);
    // Where a parallelogram over a refined neighbour expects the new vertex, against the mean of the ring. Whether
    // there is one is hard to foresee, so there is no branch: at the boundary, the undecided face of slot 0 stands in.
    const std::uint32_t outside = patch.outside[i];
    const std::uint32_t across = outside == kNone ? HalfEdgeMesh::halfedge(patch.slots[0], 0) : outside;
    const bool refined = marks.face[HalfEdgeMesh::face_of(across)] != 0;
    kite[i] = kIfRefined[refined] * (vertex_[mesh.apex(across)].position - ring[i + 1 < kSize ? i + 1 : 0] - spoke[i]);
    kite_count += refined ? 1u : 0u;
  }
  for (unsigned i = kSize; i < 8; ++i) spoke[i] = spoke[kSize - 1];
  const Four kites_low = squared(kite[0], kite[1], kite[2], kite[3]);
  const Four kites_high = kIsLarge ? squared(kite[4], kite[5], kite[6], kite[7]) : Four{};
  const float kites = sum_of(kites_low + kites_high);
  const float of_gate = kIsLarge ? kites_high[kSize % 4 == 1 ? 0 : 1] : kites_low[kSize == 3 ? 2 : 3];
  const Four spokes_low = squared(spoke[0], spoke[1], spoke[2], spoke[3]);
  const Four spokes_high = kIsLarge ? squared(spoke[4], spoke[5], spoke[6], spoke[7]) : spokes_low;
  const float spokes = (kSize == 3 ? spokes_low[0] + spokes_low[1] + spokes_low[2] : sum_of(spokes_low)) +
                       (kSize == 6 ? spokes_high[0] + spokes_high[1] : (kSize == 5 ? spokes_high[0] : 0.0f));
  const float least = least_of(smaller(spokes_low, spokes_high));
  const float most = most_of(larger(spokes_low, spokes_high));
  float diagonals = 0;
  float longest_diagonal = 0;
  float shortest_diagonal = 1e30f;
  for (unsigned k = 0; k + 1u < kTriangles; ++k) {
    const Four along = ring[triangulation.diagonal[k][0]] - ring[triangulation.diagonal[k][1]];
    const float diagonal = dot(along, along);
    diagonals += diagonal;
    longest_diagonal = std::max(longest_diagonal, diagonal);
    shortest_diagonal = std::min(shortest_diagonal, diagonal);
  }

  for (unsigned i = kSize; i < kMaxPatchSize; ++i) h.state[i] = kNoVertex;
  const float border_mean = border * kShareOfRing;
  const float face_area = area * (kIsBorder ? kShare[kSize - 1] : kShareOfRing);
  const Four unit = Four{} + scale.per_edge_squared;
  const Four diagonal_logs =
      0.5f * fast_log2(Four{diagonals * kShare[kTriangles - 1u], shortest_diagonal, longest_diagonal, 0} * unit +
                       kLeastOffset);
  const Four lengths = 0.5f * fast_log2(Four{most, least, of_gate, kites * kShare[kite_count]} * unit + kLeastOffset);
  const Four whole = guarded_log2(Four{face_area, spokes * kShareOfRing, 1.0f, 1.0f});
  h.log_area = whole[0];
  h.log_spoke = 0.5f * whole[1];
  set_bounded(h.input,
              std::array{Four{h.log_area - scale.log_area, 0.3f * static_cast<float>(regular),
                              kSize > 3 ? diagonal_logs[1] : 0.0f, border_mean - scale.log_edge},
                         Four{longest - border_mean, static_cast<float>(recent) * kShareOfRing,
                              kSize > 3 ? diagonal_logs[0] : 0.0f, kSize > 3 ? diagonal_logs[2] : 0.0f},
                         Four{shortest - border_mean, lengths[0], lengths[1], of_gate > 0 ? lengths[2] : 0.0f},
                         Four{kite_count > 0 ? lengths[3] : 0.0f, static_cast<float>(kite_count) * kShareOfRing,
                              least_face - scale.log_area, most_face - scale.log_area}});
}

// Its features are the face's own, the first half of what look_at_face saw.
inline void Surroundings::describe_null(std::uint32_t s, std::uint32_t t, std::uint32_t front) {
  Hypothesis& h = hypothesis_[0];
  auto state_after = [&](std::uint32_t v) { return kOutcome[3 * 1 + 1][vertex_[v].brief].state; };
  h.symbol = kNull;
  h.row = 0;
  h.state = {state_after(t), state_after(front), state_after(s), kNoVertex, kNoVertex, kNoVertex};
  std::copy_n(face_view_.input.value.begin(), kSymbolInputs, h.input.value.begin());
}

std::span<const Hypothesis> Surroundings::look(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate,
                                               Tag tag_s, Tag tag_t) {
  const std::uint32_t s = mesh.origin(gate);
  const std::uint32_t t = mesh.target(gate);
  const std::uint32_t front = mesh.apex(gate);
  describe_null(s, t, front);
  std::size_t count = 1;
  auto consider = [&]<unsigned kSize, bool kIsBorder>(const Triangulation& triangulation, unsigned closing,
                                                      std::size_t row) {
    Hypothesis& h = hypothesis_[count];
    if (!collect_polygon(mesh, gate, triangulation, closing, marks.face, h.patch)) return;
    h.symbol = kIsBorder ? border_symbol(kSize, closing) : static_cast<Symbol>(kSize);
    h.row = static_cast<std::uint8_t>(row);
    describe_patch<kSize, kIsBorder>(mesh, marks, triangulation, h);
    ++count;
  };
  auto consider_interior = [&]<unsigned kSize>() {
    consider.template operator()<kSize, false>(interior_triangulation(kSize, tag_s, tag_t), kNoClosing, kSize - 2u);
  };
  auto consider_border = [&]<unsigned kSize>() {
    for (unsigned closing = 0; closing + 1 < kSize; ++closing) {
      consider.template operator()<kSize, true>(border_triangulation(kSize, closing, tag_t), closing,
                                                5u + border_symbol(kSize, closing) - kBorder);
    }
  };
  if (kind_ == PassKind::cleaning) {
    tag_s = Tag::plus;
    tag_t = Tag::minus;
    consider_interior.template operator()<3>();
    return {hypothesis_.data(), count};
  }
  // A border patch takes in a boundary edge of at most two faces: then a vertex of the gate's face lies there.
  if (has_boundary_ && (mesh.is_boundary(s) || mesh.is_boundary(t) || mesh.is_boundary(front))) {
    consider_border.template operator()<4>();
    consider_border.template operator()<3>();
  }
  consider_interior.template operator()<6>();
  consider_interior.template operator()<5>();
  consider_interior.template operator()<4>();
  consider_interior.template operator()<3>();
  return {hypothesis_.data(), count};
}

}  // namespace pmcd::codec
