// SPDX-License-Identifier: MIT
#include "codec/conquest/symbol_network.h"

namespace pmcd::codec {
namespace {

float weight(std::int16_t stored) {
  return static_cast<float>(stored) * (1.0f / SymbolWeights::kScale);
}

// The four units with unit q.
template <std::size_t kUnits>
FourInts load_units(const std::array<std::int16_t, kUnits>& stored, std::size_t q) {
  const std::size_t first = q / 4 * 4;
  return FourInts{stored[first], stored[first + 1], stored[first + 2], stored[first + 3]};
}

using GateFeatures = std::array<float, kGateFeatures>;

// The inverse of SymbolModel's gate_state.
GateFeatures features_of_state(std::size_t state) {
  GateFeatures f{};
  const std::size_t tags = state % 4;
  const std::size_t beside = state / 4 % 4;
  const std::size_t front = state / 16;
  f[0] = front > 0 ? 1.0f : 0.0f;
  f[1] = front == 2 ? 1.0f : 0.0f;
  f[2] = front == 3 ? 1.0f : 0.0f;
  f[3] = beside % 2 == 1 ? 1.0f : 0.0f;
  f[4] = beside >= 2 ? 1.0f : 0.0f;
  f[5] = tags % 2 == 1 ? 1.0f : 0.0f;
  f[6] = tags >= 2 ? 1.0f : 0.0f;
  return f;
}

// The inverse of parent_code; borders, seeds and steps are alike to it.
GateFeatures features_of_parent(std::size_t parent) {
  GateFeatures f{};
  const std::size_t symbol = parent < 2 ? 0 : (parent < 22 ? 1 + (parent - 2) / 5 : 5);
  if (symbol < 5) f[7 + symbol] = 1.0f;
  f[12] = 0.3f * static_cast<float>(parent < 2 ? parent : (parent - 2) % 5);
  return f;
}

template <std::size_t kCount>
using Stored = std::array<std::int16_t, kCount>;

template <std::size_t kInputs, std::size_t kUnits>
void make_row(const std::array<Stored<kUnits>, kInputs>& hidden, const std::array<Stored<kUnits>, kGateFeatures>& gate,
              const Stored<kUnits>& bias, const Stored<kUnits>& output, const Stored<kInputs>& linear,
              SymbolNetwork::Row<kInputs, kUnits>& row) {
  auto add_gate = [&](const GateFeatures& f, Lanes<kUnits>& lanes) {
    for (std::size_t g = 0; g < kGateFeatures; ++g) {
      for (std::size_t q = 0; q < kUnits; ++q) lanes.value[q] += f[g] * weight(gate[g][q]);
    }
  };
  for (std::size_t j = 0; j < kInputs; ++j) {
    row.linear.value[j] = weight(linear[j]);
    for (std::size_t q = 0; q < kUnits; ++q) {
      const std::size_t low = j / 8 * 8 + j % 4;
      row.hidden[j / 8 * 4 + j % 4][q / 4] = pairs_of(load_units(hidden[low], q), load_units(hidden[low + 4], q));
    }
  }
  for (std::size_t q = 0; q < kUnits; ++q) row.output.value[q] = weight(output[q]);
  for (std::size_t s = 0; s < kGateStates; ++s) {
    for (std::size_t q = 0; q < kUnits; ++q) row.by_state[s].value[q] = weight(bias[q]);
    add_gate(features_of_state(s), row.by_state[s]);
  }
  for (std::size_t p = 0; p < kParents; ++p) add_gate(features_of_parent(p), row.by_parent[p]);
}

template <std::size_t kCount>
void make_weights(const Stored<kCount>& stored, std::array<float, kCount>& weights) {
  for (std::size_t i = 0; i < kCount; ++i) weights[i] = weight(stored[i]);
}

SymbolNetwork make() {
  SymbolNetwork network{};
  const SymbolWeights& from = kSymbolWeights;
  for (std::size_t r = 0; r < kSymbolRows; ++r) {
    make_row(from.hidden[r], from.gate[r], from.bias[r], from.output[r], from.linear[r], network.row[r]);
  }
  for (std::size_t kind = 0; kind < 2; ++kind) {
    make_weights(from.state[kind], network.state[kind]);
    const SymbolWeights::OfFace& face = from.face[kind];
    make_row(face.hidden, face.gate, face.bias, face.output, face.linear, network.face[kind]);
    make_weights(face.corner, network.face[kind].corner);
    make_weights(face.state, network.face[kind].state);
    make_weights(face.parent, network.face[kind].parent);
  }
  return network;
}

}  // namespace

const SymbolNetwork& symbol_network() {
  static const SymbolNetwork network = make();
  return network;
}

}  // namespace pmcd::codec
