// SPDX-License-Identifier: MIT
// Everything here steers decoding: single precision in a fixed order, scores bounded.
#include "codec/conquest/symbol_model.h"

namespace pmcd::codec {
namespace {

// Steps of the descent, measured on scans; twice or half of each costs less than 0.01 bits a vertex.
constexpr float kLinearRate = 0.007f;
constexpr float kStateRate = 0.004f;
constexpr float kOutputRate = 0.005f;

}  // namespace

SymbolModel::SymbolModel() {
  const SymbolNetwork& network = symbol_network();
  for (std::size_t r = 0; r < kSymbolRows; ++r) {
    linear_[r] = network.row[r].linear;
    output_[r] = network.row[r].output;
  }
  state_ = network.state;
}

void SymbolModel::weigh(std::span<const Hypothesis> hypotheses, std::size_t state, std::size_t parent,
                        Weighed& weighed) const {
  const SymbolNetwork& network = symbol_network();
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    const SymbolNetwork::Row& row = network.row[h.row];
    HiddenLanes sum;
    for (std::size_t q = 0; q < kHiddenUnits; ++q) {
      sum.value[q] = row.by_state[state].value[q] + row.by_parent[parent].value[q];
    }
    for (std::size_t j = 0; j < kSymbolInputs; ++j) add_scaled(sum, h.input.value[j], row.hidden[j]);
    for (float& unit : sum.value) unit = std::max(unit, 0.0f);
    weighed.hidden[i] = sum;
    float score = dot(linear_[h.row], h.input) + dot(output_[h.row], sum);
    const auto& of_state = state_[h.row == 0 ? 0 : 1];
    for (std::size_t k = 0; k < h.vertices; ++k) score += of_state[h.state[k]];
    weighed.share[i] = std::clamp(score, -60.0f, 60.0f);
  }
  softmax(weighed.share.data(), hypotheses.size());
}

void SymbolModel::learn(std::span<const Hypothesis> hypotheses, const Weighed& weighed, std::size_t holds) {
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    const float error = (i == holds ? 1.0f : 0.0f) - weighed.share[i];
    add_scaled(linear_[h.row], kLinearRate * error, h.input);
    add_scaled(output_[h.row], kOutputRate * error, weighed.hidden[i]);
    auto& of_state = state_[h.row == 0 ? 0 : 1];
    for (std::size_t k = 0; k < h.vertices; ++k) of_state[h.state[k]] += kStateRate * error;
  }
}

}  // namespace pmcd::codec
