// SPDX-License-Identifier: MIT
// Where vertices stand while only their connectivity is known, in packets that ask for guesses (others leave them at
// the mean of the polygon that they were inserted into): a fixed mean of the ring bent by what the ring knows of the
// surface. All connectivity of a packet is read before its positions, so that the first positions see the shape of the
// finest mesh. Gain at 12 bits, of that with three passes a packet and one guess: 1.0 bit a vertex (mean of camel,
// bunny, armadillo, fandisk, horse); of guesses before each pass against none: 0.2.
#pragma once

#include "codec/geometry/surface.h"
#include "codec/mesh/halfedge_mesh.h"

namespace pmcd::codec {

/// Guesses where the vertices from `first` on stand, within 0 .. most (half lattice steps), each by where the others
/// stand by then, and hands them the mean spread of their rings. [linear]
void place_provisionally(const HalfEdgeMesh& mesh, Surface& surface, std::uint32_t first, std::int32_t most);

}  // namespace pmcd::codec
