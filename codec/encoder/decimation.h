// SPDX-License-Identifier: MIT
// The encoder's way down: conquest after conquest takes vertices out until the base mesh stands, and what was decided
// is recorded for replay in the other direction. It measures and codes nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "codec/conquest/conquest.h"
#include "codec/conquest/legality.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// One conquest: its symbols in the order of the walk, and the vertices that it removed, in the same order.
struct PassRecord {
  PassKind kind = PassKind::decimating;
  std::vector<Symbol> symbols;
  std::vector<std::uint32_t> removed;
  std::vector<std::uint32_t> ear_base;  ///< ear pass: ascending; ear removed[k] stands beyond the edge that leaves it
};

struct DecimationOptions {
  GeometricLimits limits;
  bool cleaning = false;
};

/// Told how many vertices are left; answers whether to go on.
using DecimationProgress = std::function<bool(std::uint32_t vertices_left)>;

/// One seed for each component with faces, in the order of their first faces. [linear]
std::vector<Seed> choose_seeds(const HalfEdgeMesh& mesh);

/// Decimates `mesh` in place (faces get other numbers, vertices keep theirs) and answers the passes, fine to coarse.
/// When a pass stalls, the geometric limits are given up, for a level that cannot shrink is worse than a bent face; the
/// topological ones never. Stops when nothing is left to remove or the mesh is small. An empty answer with `cancelled`
/// set: progress said no. [a few walks over the mesh; 3 bytes a vertex and pass]
std::vector<PassRecord> decimate(HalfEdgeMesh& mesh, std::span<const LatticePoint> points, std::span<const Seed> seeds,
                                 const DecimationOptions& options, const DecimationProgress& progress, bool& cancelled);

}  // namespace pmcd::codec
