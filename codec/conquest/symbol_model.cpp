// SPDX-License-Identifier: MIT
// Everything here steers decoding: single precision in a fixed order, scores bounded.
#include "codec/conquest/symbol_model.h"

namespace pmcd::codec {
namespace {

// Steps of the descent, measured on scans; twice or half of each costs less than 0.01 bits a vertex.
constexpr float kLinearRate = 0.007f;
constexpr float kStateRate = 0.004f;
constexpr float kOutputRate = 0.005f;

// The score of one row without its tables; the units are kept for learning.
template <std::size_t kInputs, std::size_t kUnits>
float score(const SymbolNetwork::Row<kInputs, kUnits>& row, const Lanes<kInputs>& input, std::size_t state,
            std::size_t parent, const Lanes<kInputs>& linear, const Lanes<kUnits>& output, Lanes<kUnits>& hidden) {
  constexpr std::size_t kFours = kUnits / 4;
  std::array<FourInts, kFours> sum{};
  auto add = [&]<int k>(FourInts pairs, const std::array<FourInts, kFours>& weights) {
    const FourInts pair = __builtin_shufflevector(pairs, pairs, k, k, k, k);
    for (std::size_t q = 0; q < kFours; ++q) sum[q] += dot_pairs(pair, weights[q]);
  };
  for (std::size_t g = 0; g < kInputs / 8; ++g) {
    const Four low = SymbolNetwork::kInputScale * load_four(&input.value[8 * g]);
    const Four high = SymbolNetwork::kInputScale * load_four(&input.value[8 * g + 4]);
    const FourInts pairs = pairs_of(__builtin_convertvector(low, FourInts), __builtin_convertvector(high, FourInts));
    add.template operator()<0>(pairs, row.hidden[4 * g]);
    add.template operator()<1>(pairs, row.hidden[4 * g + 1]);
    add.template operator()<2>(pairs, row.hidden[4 * g + 2]);
    add.template operator()<3>(pairs, row.hidden[4 * g + 3]);
  }
  Four total{};
  for (std::size_t q = 0; q < kFours; ++q) {
    const Four all = SymbolNetwork::kHiddenScale * __builtin_convertvector(sum[q], Four) +
                     (load_four(&row.by_state[state].value[4 * q]) + load_four(&row.by_parent[parent].value[4 * q]));
    const Four unit = larger(all, Four{});
    store_four(&hidden.value[4 * q], unit);
    total += unit * load_four(&output.value[4 * q]);
  }
  for (std::size_t j = 0; j < kInputs; j += 4) total += load_four(&linear.value[j]) * load_four(&input.value[j]);
  return sum_of(total);
}

}  // namespace

SymbolModel::SymbolModel(PassKind kind) : network_(&symbol_network()), kind_(kind == PassKind::cleaning ? 1 : 0) {
  const SymbolNetwork& network = *network_;
  const SymbolNetwork::FaceRow& face = network.face[kind_];
  face_.linear = face.linear;
  face_.output = face.output;
  std::copy(face.corner.begin(), face.corner.end(), face_.corner.begin());
  face_.corner[kNoCorner] = 0;
  face_.state = face.state;
  face_.parent = face.parent;
  for (std::size_t r = 0; r < kSymbolRows; ++r) {
    linear_[r] = network.row[r].linear;
    output_[r] = network.row[r].output;
  }
  for (std::size_t null = 0; null < 2; ++null) {
    std::copy(network.state[null].begin(), network.state[null].end(), state_[null].begin());
    state_[null][kNoVertex] = 0;
  }
}

float SymbolModel::weigh_face(const FaceView& view, std::size_t state, std::size_t parent, FaceLanes& hidden) const {
  const float of_gate = score(network_->face[kind_], view.input, state, parent, face_.linear, face_.output, hidden);
  const auto& corner = face_.corner;
  const float tables =
      ((corner[view.corner[0]] + corner[view.corner[1]]) + (corner[view.corner[2]] + corner[view.corner[3]])) +
      (corner[view.corner[4]] + (face_.state[state] + face_.parent[parent]));
  return 1.0f / (1.0f + fast_exp2(std::clamp(-(of_gate + tables), -30.0f, 30.0f)));
}

void SymbolModel::learn_face(const FaceView& view, std::size_t state, std::size_t parent, const FaceLanes& hidden,
                             float error) {
  add_scaled(face_.linear, kLinearRate * error, view.input);
  add_scaled(face_.output, kOutputRate * error, hidden);
  const float step = kStateRate * error;
  for (const std::uint16_t k : view.corner) face_.corner[k] += step;
  face_.corner[kNoCorner] = 0;
  face_.state[state] += step;
  face_.parent[parent] += step;
}

void SymbolModel::weigh(std::span<const Hypothesis> hypotheses, std::size_t state, std::size_t parent,
                        Weighed& weighed) const {
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const Hypothesis& h = hypotheses[i];
    const float of_patch =
        score(network_->row[h.row], h.input, state, parent, linear_[h.row], output_[h.row], weighed.hidden[i]);
    const auto& of_state = state_[h.row == 0 ? 0 : 1];
    const float states =
        ((of_state[h.state[0]] + of_state[h.state[1]]) + (of_state[h.state[2]] + of_state[h.state[3]])) +
        (of_state[h.state[4]] + of_state[h.state[5]]);
    weighed.share[i] = std::clamp(of_patch + states, -60.0f, 60.0f);
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
