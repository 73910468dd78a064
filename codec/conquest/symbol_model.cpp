// SPDX-License-Identifier: MIT
#include "codec/conquest/symbol_model.h"

#include <cstdlib>

namespace pmcd::codec {
namespace {
float env(const char* n, float d) { const char* e = getenv(n); return e ? (float)atof(e) : d; }
const float kRate = env("LR", 0.03f);
const float kStateRate = env("LRS", 0.03f);
const float kContextWeight = env("CW", 0.25f);
const float kSlowest = env("SLOW", 0.01f);
}  // namespace

SymbolModel::SymbolModel() {
  for (auto& rows : weight_) {
    for (SymbolInputs& row : rows) {
      for (std::size_t c = 0; c < kSymbolContexts; ++c) row.value[kGeometricInputs + c] = kContextWeight;
    }
  }
}

void SymbolModel::gather(const HalfEdgeMesh& mesh, const Marks& marks, const Surroundings& surroundings,
                         std::uint32_t gate, Tag tag_s, Tag tag_t, std::span<Hypothesis> hypotheses, Voices& voices) {
  const std::uint32_t front = mesh.apex(gate);
  auto taken = [&](std::uint32_t edge) {
    const std::uint32_t across = mesh.opposite(edge);
    return across == kNone || marks.face[HalfEdgeMesh::face_of(across)] != 0 ? 1u : 0u;
  };
  const std::size_t beside = 2 * taken(HalfEdgeMesh::next(gate)) + taken(HalfEdgeMesh::prev(gate));
  const std::size_t front_state = marks.conquered[front] == 0 ? 0u : static_cast<std::size_t>(marks.tag[front]) + 1u;
  const std::size_t around = 4 * front_state + beside;  // below 16
  const std::size_t tags = (tag_s == Tag::plus ? 2u : 0u) + (tag_t == Tag::plus ? 1u : 0u);
  voices.set = around * 4 + tags;
  const std::size_t valence = std::clamp<std::uint32_t>(mesh.face_valence(front), 3, 10) - 3;
  const std::size_t open = std::min<std::uint32_t>(surroundings.open(front), 7);
  const Hypothesis& null = hypotheses[0];
  auto level = [](float x) { return static_cast<std::size_t>(std::clamp(x * 4.0f + 8.0f, 0.0f, 15.0f)); };
  voices.context = {&by_parent_[marks.gate_parent][tags], &by_front_[around & 15][valence][open],
                    &by_ends_[null.state[0]][null.state[2]], &by_tags_[voices.set & 63],
                    &by_area_[level(null.input.value[1])][level(null.input.value[7])]};
  for (Hypothesis& h : hypotheses) {
    for (std::size_t c = 0; c < kSymbolContexts; ++c) {
      h.input.value[kGeometricInputs + c] = voices.context[c]->log2_share(share_row(h.row));
    }
  }
}

void SymbolModel::weigh(std::span<const Hypothesis> hypotheses, const Voices& voices,
                        std::array<float, kSymbolRows>& p) const {
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    float score = dot(weight_[voices.set & 63][h.row], h.input);
    const auto& of_state = state_weight_[h.row == 0 ? 0 : 1];
    for (std::size_t k = 0; k < h.vertices; ++k) score += of_state[h.state[k]];
    p[i] = std::clamp(score, -60.0f, 60.0f);
  }
  softmax(p.data(), hypotheses.size());
}

void SymbolModel::learn(std::span<const Hypothesis> hypotheses, const Voices& voices,
                        const std::array<float, kSymbolRows>& p, std::size_t seen) {
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    const float error = (i == seen ? 1.0f : 0.0f) - p[i];
    add_scaled(weight_[voices.set & 63][h.row], kRate * error, h.input);
    auto& of_state = state_weight_[h.row == 0 ? 0 : 1];
    for (std::size_t k = 0; k < h.vertices; ++k) of_state[h.state[k]] += kStateRate * error;
  }
  for (Shares* shares : voices.context) shares->update(share_row(hypotheses[seen].row), kSlowest);
}

}  // namespace pmcd::codec
