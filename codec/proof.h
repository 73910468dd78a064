// SPDX-License-Identifier: MIT
// The proof of an encoding: the packets are decoded by the public decoder and the last level is compared with the
// original, vertex by vertex under the numbering that the encoder claims, face by face with multiplicity. Whoever wants
// to look at the levels too does so on the way, and no packet is decoded twice.
#pragma once

#include <cstddef>
#include <functional>

#include "codec/decoder.h"
#include "codec/encoder.h"
#include "codec/mesh/triangle_mesh.h"
#include "codec/result.h"

namespace pmcd::codec {

/// Shown each level once it stands, level 0 first; answers whether to go on.
using LevelObserver = std::function<bool(std::size_t level, const Decoder& decoder)>;

/// Proves that `encoded` is an encoding of `original`: its packets are complete, and decode to the same faces and to
/// positions of the same bits (snapped to the lattice if that was asked for). Packets are not to be stored, sent or
/// written to a file before this was so; encode() does not look.
/// REQUIRES of `original`: what encode() does.
/// Errors: internal_error when anything differs; cancelled when `seen` says no, which is then asked no more.
/// Memory: the decoder's while it decodes, then two meshes' beside the original. Time: decoding, then linear.
Status prove(const Encoded& encoded, const TriangleMesh& original, const LevelObserver& seen = {});

}  // namespace pmcd::codec
