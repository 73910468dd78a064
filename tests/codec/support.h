// SPDX-License-Identifier: MIT
// What the codec's tests share: a validator of half-edge meshes, a comparer of meshes that shares no code with prove(),
// and decoding level by level. Answers are sentences; an empty one means that all is well.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "codec/decoder.h"
#include "codec/encoder.h"
#include "codec/mesh/halfedge_mesh.h"
#include "codec/mesh/triangle_mesh.h"

namespace pmcd::codec::testing {

/// Everything that HalfEdgeMesh promises: corners, symmetric opposites, the outgoing rule, face valences, one fan a
/// vertex. Free slots are skipped.
std::string complaint(const HalfEdgeMesh& mesh);

/// Cyclic triples of the faces that are not free, smallest corner first, sorted.
std::vector<Face> sorted_faces(const HalfEdgeMesh& mesh);
std::vector<Face> sorted_faces(std::vector<Face> faces);

/// The difference up to numbering: the positions' bits as a multiset, and the cyclic triples of positions as a
/// multiset. Exact when no two vertices share a position.
std::string difference(const TriangleMesh& wanted, const TriangleMesh& got);

/// The mesh snapped to the lattice of `bits`, by the formula of the format's description.
TriangleMesh snapped(const TriangleMesh& mesh, unsigned bits);

/// Decodes all packets; checks each level: counts as announced, manifold, vertices grow (but for an exactness packet,
/// the last of a lossless mesh), `last` on the last only. `result` is the last level.
std::string decode_levels(std::span<const EncodedPacket> packets, TriangleMesh& result);

/// encode(), prove(), decode_levels(), and the last level against the original (snapped, if bits are asked for).
std::string round_trip(const TriangleMesh& mesh, const EncodeOptions& options, Encoded* encoded = nullptr);

/// "name at where: detail".
std::string text(const Error& error);

std::vector<std::span<const std::byte>> spans(const std::vector<EncodedPacket>& packets);

/// A .pmcd file of the packets.
std::vector<std::byte> to_file(const std::vector<EncodedPacket>& packets);

/// The same packet with header fields and payload as they are and the checksum made right.
std::vector<std::byte> with_right_checksum(std::vector<std::byte> packet);

}  // namespace pmcd::codec::testing
