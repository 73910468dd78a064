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
    std::array<Four, kHiddenUnits / 4> sum;
    for (std::size_t q = 0; q < sum.size(); ++q) {
      sum[q] = load_four(&row.by_state[state].value[4 * q]) + load_four(&row.by_parent[parent].value[4 * q]);
    }
    for (std::size_t j = 0; j < kSymbolInputs; ++j) {
      const float input = h.input.value[j];
      for (std::size_t q = 0; q < sum.size(); ++q) sum[q] += input * load_four(&row.hidden[j].value[4 * q]);
    }
    Four output{};
    for (std::size_t q = 0; q < sum.size(); ++q) {
      const Four unit = sum[q] > 0.0f ? sum[q] : Four{};
      store_four(&weighed.hidden[i].value[4 * q], unit);
      output += unit * load_four(&output_[h.row].value[4 * q]);
    }
    float score = dot(linear_[h.row], h.input) + sum_of(output);
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
