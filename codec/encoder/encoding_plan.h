// SPDX-License-Identifier: MIT
// What the encoder knows before it writes: what holds for every way to write a mesh (EncodingPlan), and the way down to
// a base mesh (Descent). Both are made once and shared by all variants of the stream that are tried.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "codec/encoder.h"
#include "codec/encoder/decimation.h"
#include "codec/encoder/precision.h"
#include "codec/geometry/reflection.h"
#include "codec/lattice/exactness_form.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"
#include "codec/result.h"

namespace pmcd::codec {

/// Original numbering.
struct EncodingPlan {
  const TriangleMesh* original = nullptr;
  Lattice lattice;
  bool lossless = false;
  ExactnessForm form;  ///< of the exactness section, if there is one
  std::vector<LatticePoint> points;
  std::vector<std::uint32_t> isolated;  ///< in the order in which they are coded
  std::uint32_t boundary_edges = 0;
  Alignment alignment = Alignment::none;
  PrecisionPlan precision;
  Reflection reflection;

  [[nodiscard]] bool has_exactness() const { return lossless && !lattice.exact && !points.empty(); }
  [[nodiscard]] std::uint32_t vertices_in_faces() const {
    return static_cast<std::uint32_t>(points.size() - isolated.size());
  }
};

/// A base mesh and the passes up from it.
struct Descent {
  HalfEdgeMesh base;                         ///< in numbers of its own; no isolated vertices
  std::vector<std::uint32_t> base_vertices;  ///< the base's vertices in original numbering, ascending
  std::vector<Seed> seeds;                   ///< in the base's numbers
  std::vector<PassRecord> passes;            ///< coarse to fine; original numbering
};

/// Looks at the mesh. `bits` as in EncodeOptions; `built` becomes its half-edges, for descend. Errors: those of
/// Lattice::over and HalfEdgeMesh::build. `mesh` must outlive the plan. [linear; lossless n log n]
Result<EncodingPlan> make_plan(const TriangleMesh& mesh, std::optional<unsigned> bits, HalfEdgeMesh& built);

/// Decimates `mesh`, which is used up. Nothing: progress said no.
std::optional<Descent> descend(HalfEdgeMesh mesh, const EncodingPlan& plan, const DecimationOptions& options,
                               const DecimationProgress& progress);

/// The way of no steps: all of `mesh` is the base.
Descent stay(const HalfEdgeMesh& mesh);

}  // namespace pmcd::codec
