// SPDX-License-Identifier: MIT
// May this vertex go? Asked by the encoder only; every veto costs a null symbol, so any rule is free to veto. The
// topological rules keep the mesh manifold and are never waived; the geometric ones are options.
#pragma once

#include <optional>
#include <span>

#include "codec/conquest/patch.h"
#include "codec/lattice/lattice.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

struct GeometricLimits {
  double min_flip_cosine = -1;            ///< of a new face's normal against the patch's; -1: no limit
  std::optional<double> max_shape_error;  ///< cbrt(volume between the surfaces) / mean ring edge
};

/// No new edge or face stands in the mesh already: removing the star's centre keeps the mesh manifold.
/// REQUIRES: collect_star's patch and the triangulation that would replace it. [constant, but for large valences]
bool keeps_manifold(const HalfEdgeMesh& mesh, const Patch& patch, const Triangulation& triangulation);

/// Whether the new faces stay within the limits. Faces of zero area have no direction and do not veto.
bool keeps_shape(std::span<const LatticePoint> points, const Patch& patch, const Triangulation& triangulation,
                 const GeometricLimits& limits);

}  // namespace pmcd::codec
