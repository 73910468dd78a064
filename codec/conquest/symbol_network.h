// SPDX-License-Identifier: MIT
// The part of the symbol model that is trained once and for all: a network with one hidden layer for each kind of
// hypothesis and for the gate's face, and where the parts that adapt while coding start from. A function of the
// features (hypothesis.h), of the state of the gate and of its parent. Its numbers (symbol_weights.cpp) were fitted to
// meshes outside of the bench, those of the face by bench/codec/train_symbols. Ours; learnt mixing of predictions in
// the logistic domain is Mahoney's (PAQ7, 2005). Measured on six meshes of the bench, bits a vertex: counted
// contexts 3.10; a linear softmax of the same features that starts from nothing 2.14; the same, trained 1.98; this 1.74
// (12 hidden units: 1.736, 20: 1.72).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "codec/conquest/conquest.h"
#include "codec/conquest/hypothesis.h"

namespace pmcd::codec {

inline constexpr std::size_t kHiddenUnits = 8;
inline constexpr std::size_t kGateStates = 64;    ///< front vertex and its tag, faces beside the gate, tags of its ends
inline constexpr std::size_t kGateFeatures = 13;  ///< what the training saw of them: 7 of the state, 6 of the parent

using HiddenLanes = Lanes<kHiddenUnits>;
inline constexpr std::size_t kFaceUnits = 8;
using FaceLanes = Lanes<kFaceUnits>;

/// As stored, times kScale.
struct SymbolWeights {
  static constexpr float kScale = 1024.0f;
  std::array<std::array<std::array<std::int16_t, kHiddenUnits>, kSymbolInputs>, kSymbolRows> hidden;
  std::array<std::array<std::array<std::int16_t, kHiddenUnits>, kGateFeatures>, kSymbolRows> gate;
  std::array<std::array<std::int16_t, kHiddenUnits>, kSymbolRows> bias;
  std::array<std::array<std::int16_t, kHiddenUnits>, kSymbolRows> output;
  std::array<std::array<std::int16_t, kSymbolInputs>, kSymbolRows> linear;
  std::array<std::array<std::int16_t, kVertexStates>, 2> state;
  struct OfFace {
    std::array<std::array<std::int16_t, kFaceUnits>, kFaceInputs> hidden;
    std::array<std::array<std::int16_t, kFaceUnits>, kGateFeatures> gate;
    std::array<std::int16_t, kFaceUnits> bias;
    std::array<std::int16_t, kFaceUnits> output;
    std::array<std::int16_t, kFaceInputs> linear;
    std::array<std::int16_t, kCornerStates> corner;
    std::array<std::int16_t, kGateStates> state;
    std::array<std::int16_t, kParents> parent;
  };
  std::array<OfFace, 2> face;  ///< in decimating passes, in cleaning ones
};
extern const SymbolWeights kSymbolWeights;  // NOLINT(readability-identifier-naming): a constant, in another file

/// Ready for use, with the gate's part summed for each of its states.
struct SymbolNetwork {
  // Inputs in 16 bits: all that is summed of one unit stays below 2^31.
  static constexpr float kInputScale = 2048.0f;
  static constexpr float kHiddenScale = 1.0f / (kInputScale * SymbolWeights::kScale);
  template <std::size_t kInputs, std::size_t kUnits>
  struct Row {
    /// Of input 8 g + k and, as the upper half, 8 g + 4 + k by four units at a time: [4 g + k][unit / 4].
    std::array<std::array<FourInts, kUnits / 4>, kInputs / 2> hidden;
    std::array<Lanes<kUnits>, kGateStates> by_state;
    std::array<Lanes<kUnits>, kParents> by_parent;
    Lanes<kUnits> output;   ///< start of what adapts
    Lanes<kInputs> linear;  ///< likewise
  };
  struct FaceRow : Row<kFaceInputs, kFaceUnits> {
    std::array<float, kCornerStates> corner;  ///< starts of what adapts, as the next two
    std::array<float, kGateStates> state;
    std::array<float, kParents> parent;
  };
  std::array<Row<kSymbolInputs, kHiddenUnits>, kSymbolRows> row;
  std::array<std::array<float, kVertexStates>, 2> state;  ///< start of what adapts; of null patches, of others
  std::array<FaceRow, 2> face;
};
const SymbolNetwork& symbol_network();

}  // namespace pmcd::codec
