// SPDX-License-Identifier: MIT
// The gate's own face and the two beyond it: what tells whether it stays as it is. Steers decoding, as
// surroundings.cpp.
#include <algorithm>

#include "codec/conquest/features.h"
#include "codec/conquest/hypothesis.h"

namespace pmcd::codec {

using features::kLeastOffset;
using features::kOutcome;
using features::set_bounded;
using features::squared;

namespace {

// A fifth of each number up to 16.
constexpr auto kFew = [] {
  std::array<float, 17> fifths{};
  for (std::size_t n = 0; n < fifths.size(); ++n) fifths[n] = 0.2f * static_cast<float>(n);
  return fifths;
}();

}  // namespace

inline std::uint16_t Surroundings::corner_of(std::uint32_t v, std::size_t place, Tag tag) const {
  static_assert(Tag::none == Tag{0} && Tag::plus == Tag{1} && Tag::minus == Tag{2});
  const std::size_t kind = 3 * place + static_cast<std::size_t>(tag);
  return static_cast<std::uint16_t>(kind * kVertexStates + kOutcome[0][vertex_[v].brief].state);
}

Surroundings::Scale Surroundings::measure(std::uint32_t s, std::uint32_t t, std::uint32_t front) const {
  const Vertex& at_s = vertex_[s];
  const Vertex& at_t = vertex_[t];
  const Vertex& at_front = vertex_[front];
  // A little of the whole pass steadies the local means and stands in for them at a seed.
  constexpr float kPrior = 0.5f;
  const float prior = kPrior / std::max(all_.faces, 1.0f);
  const Four counts{static_cast<float>(at_s.faces), static_cast<float>(at_t.faces), static_cast<float>(at_front.faces),
                    0};
  const float faces = counts[0] + counts[1] + kPrior;
  const Four sums{at_s.log_area + at_t.log_area + at_front.log_area + prior * all_.log_area,
                  at_s.log_length + at_t.log_length + prior * all_.log_length, at_s.log_area, at_t.log_area};
  const Four means = sums / Four{faces + counts[2], faces, std::max(counts[0], 1.0f), std::max(counts[1], 1.0f)};
  return {means[0], means[1], fast_exp2(-2.0f * means[1]), means[2], means[3]};
}

const FaceView& Surroundings::look_at_face(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate) {
  const std::uint32_t t = mesh.target(gate);
  const std::uint32_t s = mesh.origin(gate);
  const std::uint32_t front = mesh.apex(gate);
  scale_ = measure(s, t, front);
  const Scale& scale = scale_;
  FaceView& view = face_view_;
  const Vertex& at_s = vertex_[s];
  const Vertex& at_t = vertex_[t];
  const Vertex& at_front = vertex_[front];
  view.corner = {corner_of(s, 0, marks.tag[s]), corner_of(t, 1, marks.tag[t]), corner_of(front, 2, marks.tag[front]),
                 kNoCorner, kNoCorner};
  auto recent = [&](std::uint32_t v) { return static_cast<int>(v >= previous_); };
  auto few = [](std::uint32_t n) { return kFew[std::min<std::uint32_t>(n, kFew.size() - 1)]; };

  const Four sum = at_s.position + at_t.position + at_front.position;
  const std::array<std::uint32_t, 2> inner = {HalfEdgeMesh::next(gate), HalfEdgeMesh::prev(gate)};
  std::array<Four, 3> kite{};  // over the face beyond each side, over the one behind the gate
  std::array<float, 2> refined{};
  int recent_beyond = 0;
  std::array<Four, 2> beyond{};  // log area, log lengths, whether there is a face that is undecided
  std::array<float, 2> valence{};
  std::array<float, 2> open{};
  for (std::size_t side = 0; side < 2; ++side) {
    const std::uint32_t across = mesh.opposite(inner[side]);
    if (across == kNone) continue;
    const std::uint32_t apex = mesh.apex(across);
    const Vertex& at_apex = vertex_[apex];
    const Four corner = side == 0 ? at_s.position : at_t.position;
    // Where a parallelogram over the neighbour expects the corner opposite of it, against where it is.
    kite[side] = corner + corner - sum + at_apex.position;
    if (marks.face[HalfEdgeMesh::face_of(across)] != 0) {
      refined[side] = 1;
      continue;
    }
    const FaceShape& face = face_[HalfEdgeMesh::face_of(across)];
    beyond[side] = Four{face.log_area - scale.log_area,
                        face.log_length[HalfEdgeMesh::edge_of(HalfEdgeMesh::next(across))] - scale.log_edge,
                        face.log_length[HalfEdgeMesh::edge_of(HalfEdgeMesh::prev(across))] - scale.log_edge, 1};
    valence[side] = few(at_apex.valence) - 1.2f;
    open[side] = few(at_apex.open);
    recent_beyond += recent(apex);
    view.corner[3 + side] = corner_of(apex, 3 + side, marks.tag[apex]);
  }
  const std::uint32_t behind = mesh.opposite(gate);
  if (behind != kNone) {
    kite[2] = at_front.position + at_front.position - sum + vertex_[mesh.apex(behind)].position;
  }
  const Four kites = squared(kite[0], kite[1], kite[2], Four{});
  const float kite_count = refined[0] + refined[1];
  const float over_refined = refined[0] * kites[0] + refined[1] * kites[1];
  const Four logs =
      0.5f * fast_log2(Four{kites[2], kite_count > 1 ? 0.5f * over_refined : over_refined, kites[0], kites[1]} *
                           scale.per_edge_squared +
                       kLeastOffset);
  const FaceShape& face = face_[HalfEdgeMesh::face_of(gate)];
  const float log_next = face.log_length[HalfEdgeMesh::edge_of(inner[0])];
  const float log_prev = face.log_length[HalfEdgeMesh::edge_of(inner[1])];
  const float log_gate = face.log_length[HalfEdgeMesh::edge_of(gate)];
  const bool at_boundary = has_boundary_ && (mesh.is_boundary(s) || mesh.is_boundary(t) || mesh.is_boundary(front));
  set_bounded(
      view.input,
      std::array{Four{face.log_area - scale.log_area, log_next + log_prev - 2.0f * scale.log_edge,
                      few(at_front.valence) - 1.2f, few(at_front.open)},
                 Four{few(at_s.open + at_t.open), static_cast<float>(recent(front)),
                      std::max(log_next, log_prev) - log_gate, log_gate - scale.log_edge},
                 Four{few(at_s.valence) + few(at_t.valence) - 2.4f, log_next - log_prev, logs[0],
                      kite_count > 0 ? logs[1] : 0.0f},
                 Four{static_cast<float>(recent(s) + recent(t)), scale.log_area_s - scale.log_area,
                      scale.log_area_t - scale.log_area, few(at_front.faces)},
                 beyond[0], beyond[1], Four{beyond[0][3] * logs[2], beyond[1][3] * logs[3], valence[0], valence[1]},
                 Four{open[0], open[1], at_boundary ? 1.0f : 0.0f, static_cast<float>(recent_beyond)}});
  return view;
}

}  // namespace pmcd::codec
