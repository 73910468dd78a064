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
  for (std::size_t kind = 0; kind < 2; ++kind) {
    std::copy(network.state[kind].begin(), network.state[kind].end(), state_[kind].begin());
    state_[kind][kNoVertex] = 0;
  }
}

void SymbolModel::weigh(std::span<const Hypothesis> hypotheses, std::size_t state, std::size_t parent,
                        Weighed& weighed) const {
  const SymbolNetwork& network = symbol_network();
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    const SymbolNetwork::Row& row = network.row[h.row];
    constexpr std::size_t kFours = kHiddenUnits / 4;
    std::array<FourInts, kFours> sum{};
    auto add = [&]<int k>(FourInts pairs, const std::array<FourInts, kFours>& weights) {
      const FourInts pair = __builtin_shufflevector(pairs, pairs, k, k, k, k);
      for (std::size_t q = 0; q < kFours; ++q) sum[q] += dot_pairs(pair, weights[q]);
    };
    for (std::size_t g = 0; g < kSymbolInputs / 8; ++g) {
      const Four low = SymbolNetwork::kInputScale * load_four(&h.input.value[8 * g]);
      const Four high = SymbolNetwork::kInputScale * load_four(&h.input.value[8 * g + 4]);
      const FourInts pairs = pairs_of(__builtin_convertvector(low, FourInts), __builtin_convertvector(high, FourInts));
      add.template operator()<0>(pairs, row.hidden[4 * g]);
      add.template operator()<1>(pairs, row.hidden[4 * g + 1]);
      add.template operator()<2>(pairs, row.hidden[4 * g + 2]);
      add.template operator()<3>(pairs, row.hidden[4 * g + 3]);
    }
    Four output{};
    for (std::size_t q = 0; q < kFours; ++q) {
      const Four all = SymbolNetwork::kHiddenScale * __builtin_convertvector(sum[q], Four) +
                       (load_four(&row.by_state[state].value[4 * q]) + load_four(&row.by_parent[parent].value[4 * q]));
      const Four unit = larger(all, Four{});
      store_four(&weighed.hidden[i].value[4 * q], unit);
      output += unit * load_four(&output_[h.row].value[4 * q]);
    }
    for (std::size_t j = 0; j < kSymbolInputs; j += 4) {
      output += load_four(&linear_[h.row].value[j]) * load_four(&h.input.value[j]);
    }
    const auto& of_state = state_[h.row == 0 ? 0 : 1];
    const float states =
        ((of_state[h.state[0]] + of_state[h.state[1]]) + (of_state[h.state[2]] + of_state[h.state[3]])) +
        (of_state[h.state[4]] + of_state[h.state[5]]);
    weighed.share[i] = std::clamp(sum_of(output) + states, -60.0f, 60.0f);
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
    for (const std::uint8_t k : h.state) of_state[k] += kStateRate * error;
    of_state[kNoVertex] = 0;
  }
}

}  // namespace pmcd::codec
