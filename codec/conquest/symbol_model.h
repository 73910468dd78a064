// SPDX-License-Identifier: MIT
// The connectivity symbol at a gate: an online softmax over the hypotheses (hypothesis.h) that geometry and valences
// speak for or against, with counted contexts as further voices; coded as binary decisions (null? else which patch?),
// impossible ones left out at no cost. Written once for both directions.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "codec/conquest/conquest.h"
#include "codec/conquest/hypothesis.h"
#include "codec/conquest/patch.h"
#include "codec/entropy/softmax.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

class SymbolModel {
 public:
  SymbolModel();

  /// Told the vertices before a pass; answers the first vertex that the pass before inserted.
  std::uint32_t begin_pass(std::uint32_t vertices) {
    const std::uint32_t previous = before_previous_;
    before_previous_ = vertices;
    return previous;
  }

  /// Codes `wanted` (writing) or reads which of the hypotheses before the gate holds; null if none is `wanted`, which
  /// no encoder asks for. REQUIRES: look()'s answer, the null patch first.
  template <typename Source>
  const Hypothesis* code(Source& source, const HalfEdgeMesh& mesh, const Marks& marks,
                         const Surroundings& surroundings, std::uint32_t gate, Tag tag_s, Tag tag_t,
                         std::span<Hypothesis> hypotheses, Symbol wanted) {
    Voices voices;
    gather(mesh, marks, surroundings, gate, tag_s, tag_t, hypotheses, voices);
    std::array<float, kSymbolRows> p{};
    weigh(hypotheses, voices, p);
    float rest = 1;
    std::size_t seen = hypotheses.size();
    for (std::size_t i = 0; i < hypotheses.size() && seen == hypotheses.size(); ++i) {
      const bool only_one_left = i + 1 == hypotheses.size();
      if (only_one_left || source.bit_at(chance_against(p[i], rest), wanted == hypotheses[i].symbol)) seen = i;
      rest -= p[i];
    }
    learn(hypotheses, voices, p, seen);
    return &hypotheses[seen];
  }

 private:
  static constexpr std::size_t kSets = 64;
  using Shares = CountedShares<6>;  // null, 3 to 6, border patches
  static std::size_t share_row(std::size_t row) { return row < 5 ? row : 5; }

  struct Voices {
    std::size_t set = 0;
    std::array<Shares*, kSymbolContexts> context{};
  };

  // Of the next hypothesis not to hold, times 2^16, given that none before it does.
  static std::uint32_t chance_against(float p, float rest) {
    const float against = 1.0f - p / std::max(rest, 1e-9f);
    return static_cast<std::uint32_t>(std::clamp(against * 65536.0f, 24.0f, 65512.0f));
  }

  void gather(const HalfEdgeMesh& mesh, const Marks& marks, const Surroundings& surroundings, std::uint32_t gate,
              Tag tag_s, Tag tag_t, std::span<Hypothesis> hypotheses, Voices& voices);
  void weigh(std::span<const Hypothesis> hypotheses, const Voices& voices, std::array<float, kSymbolRows>& p) const;
  void learn(std::span<const Hypothesis> hypotheses, const Voices& voices, const std::array<float, kSymbolRows>& p,
             std::size_t seen);

  std::uint32_t before_previous_ = 0;
  std::array<std::array<SymbolInputs, kSymbolRows>, kSets> weight_{};
  std::array<std::array<float, kVertexStates>, 2> state_weight_{};  // null patch, others
  std::array<std::array<Shares, 4>, kParents> by_parent_;
  std::array<std::array<std::array<Shares, 8>, 8>, 16> by_front_;
  std::array<std::array<Shares, kVertexStates>, kVertexStates> by_ends_;
  std::array<Shares, 16 * 4> by_tags_;
  std::array<std::array<Shares, 16>, 16> by_area_;
};

}  // namespace pmcd::codec
