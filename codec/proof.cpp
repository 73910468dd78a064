// SPDX-License-Identifier: MIT
#include "codec/proof.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pmcd::codec {
namespace {

Error broken(const std::string& what) {
  return {ErrorCode::internal_error, 0, "the encoder's proof failed: " + what};
}

bool same_bits(const Position& a, const Position& b) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (std::bit_cast<std::uint64_t>(a[axis]) != std::bit_cast<std::uint64_t>(b[axis])) return false;
  }
  return true;
}

Face smallest_first(const Face& face) {
  if (face[0] < face[1]) return face[0] < face[2] ? face : Face{face[2], face[0], face[1]};
  return face[1] < face[2] ? Face{face[1], face[2], face[0]} : Face{face[2], face[0], face[1]};
}

// Faces by their smallest corner, sorted within: equal multisets of cyclic triples give equal arrays.
std::vector<std::uint64_t> sorted_triples(std::span<const Face> faces, std::size_t vertex_count,
                                          std::vector<std::uint32_t>& start) {
  start.assign(vertex_count + 1, 0);
  for (const Face& face : faces) ++start[std::min({face[0], face[1], face[2]}) + 1];
  for (std::size_t v = 0; v < vertex_count; ++v) start[v + 1] += start[v];
  std::vector<std::uint64_t> rest(faces.size());
  std::vector<std::uint32_t> cursor(start.begin(), start.end() - 1);
  for (const Face& face : faces) {
    const Face turned = smallest_first(face);
    rest[cursor[turned[0]]++] = std::uint64_t{turned[1]} << 32 | turned[2];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) std::sort(rest.begin() + start[v], rest.begin() + start[v + 1]);
  return rest;
}

// The decoder is freed with it, before anything is compared.
Result<TriangleMesh> last_level(const std::vector<EncodedPacket>& packets, const LevelObserver& seen) {
  DecoderLimits unlimited;
  unlimited.max_vertices = unlimited.max_faces = ~std::uint32_t{0};
  Decoder decoder(unlimited);
  for (std::size_t k = 0; k < packets.size(); ++k) {
    const Result<Level> level = decoder.apply(packets[k].bytes);
    if (!level) return broken("packet " + std::to_string(k) + ": " + level.error().detail);
    if (seen && !seen(k, decoder)) return Error{ErrorCode::cancelled, 0, "the proof was cancelled"};
  }
  if (!decoder.has_level() || !decoder.level().last) return broken("the last packet is missing");
  return decoder.mesh();
}

}  // namespace

Status prove(const Encoded& encoded, const TriangleMesh& original, const LevelObserver& seen) {
  Result<TriangleMesh> last = last_level(encoded.packets, seen);
  if (!last) return last.error();
  TriangleMesh& decoded = *last;
  const Claim& claim = encoded.claim;
  const std::vector<std::uint32_t>& to_original = claim.to_original;
  const std::size_t count = original.positions.size();
  if (decoded.positions.size() != count || to_original.size() != count ||
      decoded.faces.size() != original.faces.size()) {
    return broken("counts differ");
  }
  std::vector<std::uint8_t> met(count, 0);
  for (std::size_t v = 0; v < count; ++v) {
    const std::uint32_t o = to_original[v];
    if (o >= count || met[o] != 0) return broken("the numbering is no bijection");
    met[o] = 1;
    const Position& there = original.positions[o];
    const Position wanted = claim.lossless ? there : claim.lattice.position(claim.lattice.snap(there));
    if (!same_bits(decoded.positions[v], wanted)) return broken("vertex " + std::to_string(o) + " has moved");
  }
  for (Face& face : decoded.faces) {
    for (std::uint32_t& v : face) v = to_original[v];
  }
  std::vector<std::uint32_t> start_a;
  std::vector<std::uint32_t> start_b;
  if (sorted_triples(decoded.faces, count, start_a) != sorted_triples(original.faces, count, start_b) ||
      start_a != start_b) {
    return broken("faces differ");
  }
  return {};
}

}  // namespace pmcd::codec
