// SPDX-License-Identifier: MIT
// The encoder's public face: a mesh in, a base packet and refinement packets out. No I/O, no threads, no exceptions.
// It does not repair meshes (codec/import does), does not prove its packets (codec/proof.h does) and does not measure
// the error of levels (codec/import does).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"
#include "codec/result.h"

namespace pmcd::codec {

/// How hard the encoder tries. Every decoder reads both; best decodes at a bit more than half of the speed.
enum class Effort : std::uint8_t {
  standard,
  best  ///< a larger last packet, positions guessed, all patches and repeated values looked at; or as standard if
        ///< smaller
};

struct EncodeOptions {
  Effort effort = Effort::standard;
  /// Bits of the cubic lattice, 4 to 24: the last level is the mesh snapped to it. None: lossless, every bit of every
  /// coordinate comes back with the last packet.
  std::optional<unsigned> bits;
  /// At most this many packets after the base packet (1 to 1000; the exactness packet of a lossless mesh counts).
  /// None: as many as make each level about twice the one before.
  std::optional<unsigned> max_packets_after_base;
  /// A cleaning conquest (valence 3) after each decimating one, as in the paper. Off: fewer bits.
  bool cleaning = false;
  /// A removal is vetoed when a new face's normal has a cosine below this against the patch normal. -1: no limit.
  double min_flip_cosine = -0.3;
  /// A removal is vetoed when cbrt(volume between old and new surface) / mean ring edge exceeds this. None: no limit.
  std::optional<double> max_shape_error;
};

/// Told how far encoding is, from 0 to 1, never falling; answers whether to go on. Called at most a few hundred times.
using Progress = std::function<bool(double fraction)>;

struct EncodedPacket {
  std::vector<std::byte> bytes;  ///< header and payload: what travels
  std::uint32_t vertices = 0;    ///< of the level that it completes, isolated ones included
  std::uint32_t faces = 0;
};

/// Where the bits went, payload bits of all packets; headers are what is missing to the sum of the packets' bytes.
struct BitReport {
  double base = 0;
  double connectivity = 0;
  double geometry = 0;
  double precision = 0;  ///< further digits of positions that were known coarsely
  double exactness = 0;  ///< what lifts lattice positions to the original coordinates
  double isolated = 0;   ///< vertices in no face
};

struct EncodeReport {
  std::uint32_t components = 0;  ///< with faces; isolated vertices are counted apart
  std::uint32_t isolated_vertices = 0;
  std::uint32_t boundary_edges = 0;
  std::uint32_t passes = 0;
  std::uint64_t gates = 0;  ///< gates with a symbol, over all passes
  BitReport bits;
};

/// What the encoder claims of the last level, for prove() to hold against the original.
struct Claim {
  bool lossless = false;  ///< the positions are the original ones bit for bit; if not, snapped to `lattice`
  Lattice lattice;
  std::vector<std::uint32_t> to_original;  ///< the original vertex of each decoder vertex
};

struct Encoded {
  std::vector<EncodedPacket> packets;  ///< packet k completes level k; packet 0 is the base mesh
  EncodeReport report;
  Claim claim;
};

/// Plans and writes the packets of `mesh`, and proves nothing: prove() (codec/proof.h) decodes them and compares the
/// last level with `mesh`. Packets that it has not seen are not to be published.
/// REQUIRES of the mesh: oriented, manifold with or without boundary, no repeated index in a face, no duplicate face,
/// finite coordinates; each is checked and refused by name. Isolated vertices and faces of zero area are fine.
/// An empty mesh encodes to one packet; so does one of many handles or components when levels would make it far larger.
/// Memory: about 400 bytes a vertex. Time: linear, a few microseconds a vertex.
/// Algorithm: Alliez and Desbrun, Progressive compression for lossless transmission of triangle meshes, SIGGRAPH 2001.
Result<Encoded> encode(const TriangleMesh& mesh, const EncodeOptions& options, const Progress& progress = {});

}  // namespace pmcd::codec
