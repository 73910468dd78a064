// SPDX-License-Identifier: MIT
// Everything that a level is made of and that the next packet builds upon: mesh, lattice points, models. Encoder and
// decoder hold the same and change it by the same functions (refine.h). A value: copying it is how a decoder keeps its
// last good level.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/conquest/conquest.h"
#include "codec/conquest/symbol_model.h"
#include "codec/entropy/integer_model.h"
#include "codec/geometry/position_coder.h"
#include "codec/geometry/predictor.h"
#include "codec/geometry/surface.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec {

/// The models live on from packet to packet; nothing is reset.
struct Models {
  SymbolModel symbol{PassKind::decimating};
  SymbolModel clean{PassKind::cleaning};
  AdaptiveBit ear;  ///< beyond a boundary edge, in ear passes
  PositionModels position;
  std::array<SignedModel, 3> isolated;  ///< per axis
};

struct LevelState {
  Lattice lattice;
  bool lossless = false;
  HalfEdgeMesh mesh;                 ///< isolated vertices are vertices without a half-edge
  std::vector<LatticePoint> points;  ///< by vertex, in half steps: the middle of the cell that is known
  unsigned shift = 0;                ///< binary digits of the lattice points that are not known yet
  std::vector<Position> exact;       ///< by vertex, once the exactness section was applied; else empty
  std::vector<Seed> seeds;           ///< one a component
  Models models;
  Predictor predictor;
  std::vector<RelativeSpread> spreads;  ///< by vertex; those of isolated ones mean nothing

  std::uint32_t level = 0;
  std::uint64_t generation = 0;
  bool last = false;
};

/// The hash that a packet promises: the lattice, lattice points and faces in decoder order, the exact coordinates'
/// bits.
std::uint64_t mesh_hash(const LevelState& state);

/// The level as a mesh: exact coordinates when they are known, else those of the lattice.
TriangleMesh to_triangle_mesh(const LevelState& state);

}  // namespace pmcd::codec
