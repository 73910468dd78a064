// SPDX-License-Identifier: MIT
// The connectivity symbol at a gate: each hypothesis (hypothesis.h) gets a score from its features, from the states
// its vertices would have and from a trained network (symbol_network.h); a softmax makes probabilities of them, which
// are coded as binary decisions (null? else which patch?), impossible ones left out at no cost. The last layer adapts
// to the mesh by stochastic gradient descent. Written once for both directions.
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
  SymbolModel();

  /// Told the vertices before a pass; answers the first vertex that the pass before inserted.
  std::uint32_t begin_pass(std::uint32_t vertices) {
    const std::uint32_t previous = before_;
    before_ = vertices;
    return previous;
  }

  /// Codes `wanted` (writing) or reads which of the hypotheses before the gate holds; no encoder wants another.
  /// REQUIRES: Surroundings::look's answer.
  template <typename Source>
  const Hypothesis& code(Source& source, const HalfEdgeMesh& mesh, const Marks& marks, std::uint32_t gate, Tag tag_s,
                         Tag tag_t, std::span<const Hypothesis> hypotheses, Symbol wanted) {
    Weighed weighed;
    weigh(hypotheses, gate_state(mesh, marks, gate, tag_s, tag_t), marks.gate_parent, weighed);
    float rest = 1;
    std::size_t i = 0;
    while (i + 1 < hypotheses.size() &&
           !source.bit_at(chance_against(weighed.share[i], rest), wanted == hypotheses[i].symbol)) {
      rest -= weighed.share[i++];
    }
    learn(hypotheses, weighed, i);
    return hypotheses[i];
  }

 private:
  // Of the hypotheses at one gate.
  struct Weighed {
    alignas(16) std::array<float, (kSymbolRows + 3) / 4 * 4> share;
    std::array<HiddenLanes, kSymbolRows> hidden;
  };

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

  void weigh(std::span<const Hypothesis> hypotheses, std::size_t state, std::size_t parent, Weighed& weighed) const;
  void learn(std::span<const Hypothesis> hypotheses, const Weighed& weighed, std::size_t holds);

  std::uint32_t before_ = 0;
  std::array<SymbolInputs, kSymbolRows> linear_;
  std::array<HiddenLanes, kSymbolRows> output_;
  std::array<std::array<float, kVertexStates + 1>, 2> state_;  // null patches, others; kNoVertex weighs nothing
};

}  // namespace pmcd::codec
