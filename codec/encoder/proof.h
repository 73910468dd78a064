// SPDX-License-Identifier: MIT
// The encoder's proof: the packets are decoded by the public decoder and the last level is compared with the original,
// vertex by vertex under the numbering that the encoder knows, face by face with multiplicity.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/encoder.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

/// internal_error when the packets do not decode to `original` (its positions snapped to `lattice` unless lossless).
/// `to_original` maps decoder vertices to original ones. [linear; one more copy of the mesh]
Status prove(std::span<const EncodedPacket> packets, const TriangleMesh& original, const Lattice& lattice,
             bool lossless, std::span<const std::uint32_t> to_original);

}  // namespace pmcd::codec
