// SPDX-License-Identifier: MIT
// The connectivity symbol at a gate. A look at the gate's face tells how probably it stays as it is; where that is
// clear it is coded as such, and patches are not looked at. Otherwise each hypothesis (hypothesis.h) gets a score from
// its features, from the states its vertices would have and from a trained network (symbol_network.h); a softmax makes
// probabilities of them, which are coded as binary decisions (null? else which patch?), impossible ones left out at no
// cost. The last layers adapt to the mesh by stochastic gradient descent. Written once for both directions.
// Of the time of decoding, faces first save a fifth if every face is clear, for 0.2 to 0.3 bits a vertex.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "codec/conquest/conquest.h"
#include "codec/conquest/hypothesis.h"
#include "codec/conquest/symbol_network.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

class SymbolModel {
 public:
  /// For decimating or for cleaning passes.
  explicit SymbolModel(PassKind kind);

  /// Told the vertices before a pass; answers the first vertex that the pass before inserted.
  std::uint32_t begin_pass(std::uint32_t vertices) {
    const std::uint32_t previous = before_;
    before_ = vertices;
    return previous;
  }

  /// A face that stays more probably than this is clear. At 0 all are, at 1 none. Bits a vertex more than at 1, on
  /// bunny00: 0.28 at 0, 0.15 at 0.5, 0.06 at 0.8, 0.03 at 0.9; instructions less: a fifth, 14, 6 and 2 %.
  void set_clear(float probability) { clear_ = probability; }

  /// Codes `wanted` (writing) or reads what holds before the gate; no encoder wants what is impossible. Null: damaged
  /// data.
  template <typename Source>
  const Hypothesis* code(Source& source, Surroundings& surroundings, const HalfEdgeMesh& mesh, const Marks& marks,
                         std::uint32_t gate, Tag tag_s, Tag tag_t, Symbol wanted) {
    const FaceView& view = surroundings.look_at_face(mesh, marks, gate);
    const std::size_t state = gate_state(mesh, marks, gate, tag_s, tag_t);
    FaceLanes hidden;
    const float share = weigh_face(view, state, marks.gate_parent, hidden);
    const bool is_clear = share > clear_;
    if (is_clear && code_face(source, view, state, marks.gate_parent, share, wanted == kNull)) {
      learn_face(view, state, marks.gate_parent, hidden, 1.0f - share);
      return &surroundings.null();
    }
    std::span<const Hypothesis> hypotheses = surroundings.look(mesh, marks, gate, tag_s, tag_t);
    if (is_clear) hypotheses = hypotheses.subspan(1);
    if (hypotheses.empty()) return nullptr;
    std::size_t i = 0;
    if (hypotheses.size() > 1) {
      Weighed weighed;
      weigh(hypotheses, state, marks.gate_parent, weighed);
      float rest = 1;
      while (i + 1 < hypotheses.size() &&
             !source.bit_at(chance_against(weighed.share[i], rest), wanted == hypotheses[i].symbol)) {
        rest -= weighed.share[i++];
      }
      learn(hypotheses, weighed, i);
    }
    learn_face(view, state, marks.gate_parent, hidden, (hypotheses[i].symbol == kNull ? 1.0f : 0.0f) - share);
    return &hypotheses[i];
  }

 private:
  // Of the hypotheses at one gate.
  struct Weighed {
    alignas(16) std::array<float, (kSymbolRows + 3) / 4 * 4> share;
    std::array<HiddenLanes, kSymbolRows> hidden;
  };

  // Whether the face stays, which `share` expects; what else is there, the training looks at
  // (bench/codec/train_symbols).
  template <typename Source>
  bool code_face(Source& source, const FaceView& /*view*/, std::size_t /*state*/, std::size_t /*parent*/, float share,
                 bool stays) {
    return source.bit_at(chance_against(share, 1.0f), stays);
  }

  // Of the next hypothesis not to hold, times 2^16, given that none before it does.
  static std::uint32_t chance_against(float share, float rest) {
    const float against = 1.0f - share / std::max(rest, 1e-9f);
    return static_cast<std::uint32_t>(std::clamp(against * 65536.0f, 24.0f, 65512.0f));
  }

  static std::size_t gate_state(const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, Tag tag_s,
                                Tag tag_t) {
    const std::uint32_t front = mesh.apex(gate);
    auto taken = [&](std::uint32_t edge) {
      const std::uint32_t across = mesh.opposite(edge);
      return across == kNone || marks.face[HalfEdgeMesh::face_of(across)] != 0 ? 1u : 0u;
    };
    const std::size_t beside = 2 * taken(HalfEdgeMesh::next(gate)) + taken(HalfEdgeMesh::prev(gate));
    const std::size_t front_state = marks.conquered[front] == 0 ? 0u : static_cast<std::size_t>(marks.tag[front]) + 1u;
    return (4 * front_state + beside) * 4 + (tag_s == Tag::plus ? 2u : 0u) + (tag_t == Tag::plus ? 1u : 0u);
  }

  float weigh_face(const FaceView& view, std::size_t state, std::size_t parent, FaceLanes& hidden) const;
  void learn_face(const FaceView& view, std::size_t state, std::size_t parent, const FaceLanes& hidden, float error);
  void weigh(std::span<const Hypothesis> hypotheses, std::size_t state, std::size_t parent, Weighed& weighed) const;
  void learn(std::span<const Hypothesis> hypotheses, const Weighed& weighed, std::size_t holds);

  std::uint32_t before_ = 0;
  const SymbolNetwork* network_;
  std::size_t kind_;
  struct OfFace {
    FaceInputs linear;
    FaceLanes output;
    std::array<float, kCornerStates + 1> corner;  // kNoCorner weighs nothing
    std::array<float, kGateStates> state;
    std::array<float, kParents> parent;
  };
  OfFace face_;
  std::array<SymbolInputs, kSymbolRows> linear_;
  std::array<HiddenLanes, kSymbolRows> output_;
  std::array<std::array<float, kVertexStates + 1>, 2> state_;  // null patches, others; kNoVertex weighs nothing
  float clear_ = 0;
};

}  // namespace pmcd::codec
