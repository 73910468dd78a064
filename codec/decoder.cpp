// SPDX-License-Identifier: MIT
#include "codec/decoder.h"

#include <algorithm>
#include <string>
#include <utility>

#include "codec/base/base_mesh.h"
#include "codec/exactness.h"
#include "codec/level_state.h"
#include "codec/packet/base_header.h"
#include "codec/packet/header.h"
#include "codec/refine.h"
#include "codec/source.h"
#include "codec/tail.h"

namespace pmcd::codec {

struct Decoder::State : LevelState {};

namespace {

Status check_limits(const PacketHeader& header, std::size_t bytes, const DecoderLimits& limits) {
  auto refuse = [](const char* what, std::uint64_t claimed, std::uint64_t limit) {
    return Error{ErrorCode::limit_exceeded, claimed,
                 std::string("the packet claims ") + std::to_string(claimed) + " " + what + ", the limit is " +
                     std::to_string(limit)};
  };
  if (bytes > limits.max_packet_bytes) return refuse("bytes", bytes, limits.max_packet_bytes);
  if (header.vertices > limits.max_vertices) return refuse("vertices", header.vertices, limits.max_vertices);
  if (header.faces > limits.max_faces) return refuse("faces", header.faces, limits.max_faces);
  if (header.faces > kMaxFaces || header.vertices >= kNone) return refuse("faces", header.faces, kMaxFaces);
  return {};
}

// Growing by doubling would hold up to three copies. What the header claims is made room for, as far as so many bytes
// can mean: a vertex hardly ever costs less than half a bit.
void make_room(LevelState& state, const PacketHeader& header, std::size_t payload_bytes) {
  const std::uint64_t likely = state.mesh.vertex_count() + 16 * std::uint64_t{payload_bytes};
  const auto vertices = static_cast<std::uint32_t>(std::min<std::uint64_t>(header.vertices, likely));
  const auto faces = static_cast<std::uint32_t>(std::min<std::uint64_t>(header.faces, 2 * likely));
  state.mesh.reserve(vertices, faces);
  state.points.reserve(vertices);
  state.spreads.reserve(vertices);
}

// Codes the payload into `state`, which is a copy that may be thrown away.
Status decode_payload(LevelState& state, const PacketHeader& header, std::span<const std::byte> payload) {
  std::size_t coded_from = 0;
  if (header.is_base()) {
    Result<BaseHeader> base = parse_base_header(payload);
    if (!base) return base.error();
    state.lattice = base->lattice;
    state.lossless = base->lossless;
    coded_from = base->size;
  }
  make_room(state, header, payload.size());
  PacketReader reader(payload.subspan(coded_from));
  const LevelBounds bounds{header.vertices, header.faces};
  Status status = header.is_base()
                      ? code_base_level(state, reader, bounds.vertices, bounds.faces, header.missing_digits)
                      : code_passes(state, bounds, header.missing_digits, reader);
  if (status) status = code_isolated(state, bounds.vertices, reader);
  if (status) status = code_exactness(state, reader);
  if (!status) return status;
  const bool lifted = state.lossless && !state.lattice.exact && header.last && header.vertices > 0;
  if (state.exact.empty() == lifted) {
    return Error{ErrorCode::corrupt_data, kHeaderFlagsOffset,
                 "exactness belongs into the last packet of a lossless mesh, and only there"};
  }
  if (reader.failed()) return Error{ErrorCode::corrupt_data, payload.size(), "the payload ends too early"};
  if (!reader.at_end()) return Error{ErrorCode::corrupt_data, payload.size(), "the payload has bytes too many"};
  if (state.mesh.vertex_count() != header.vertices || state.mesh.face_count() != header.faces) {
    return Error{ErrorCode::corrupt_data, kHeaderNumbersOffset, "the level has other counts than its packet promises"};
  }
  return {};
}

}  // namespace

Decoder::Decoder(const DecoderLimits& limits) : limits_(limits) {}
Decoder::~Decoder() = default;
Decoder::Decoder(Decoder&&) noexcept = default;
Decoder& Decoder::operator=(Decoder&&) noexcept = default;

Result<Level> Decoder::apply(std::span<const std::byte> packet) {
  Result<PacketHeader> header = check_packet(packet);
  if (!header) return header.error();
  const std::uint32_t expected = state_ ? state_->level + 1 : 0;
  if (state_ && !header->is_of(state_->generation)) {
    return Error{ErrorCode::wrong_mesh, header->level, "the packet belongs to another mesh or another encoding of it"};
  }
  if (header->level != expected || (state_ && state_->last)) {
    return Error{ErrorCode::out_of_order, header->level,
                 state_ && state_->last ? "the mesh is complete, no packet follows"
                                        : "packet " + std::to_string(expected) + " comes next, this is packet " +
                                              std::to_string(header->level)};
  }
  Status limits = check_limits(*header, packet.size(), limits_);
  if (!limits) return limits.error();

  auto next = state_ ? std::make_unique<State>(*state_) : std::make_unique<State>();
  Status decoded = decode_payload(*next, *header, packet.subspan(header->size));
  if (!decoded) return decoded.error();
  if (!header->proves(mesh_hash(*next))) {
    return Error{ErrorCode::hash_mismatch, header->level, "the decoded level is not the one that was encoded"};
  }
  next->level = header->level;
  if (header->is_base()) next->generation = header->generation;  // the others have only a part of it
  next->last = header->last;
  state_ = std::move(next);
  return level();
}

bool Decoder::has_level() const {
  return state_ != nullptr;
}

Level Decoder::level() const {
  return {state_->level, state_->mesh.vertex_count(), state_->mesh.face_count(), state_->last};
}

const Lattice& Decoder::lattice() const {
  return state_->lattice;
}

TriangleMesh Decoder::mesh() const {
  return to_triangle_mesh(*state_);
}

}  // namespace pmcd::codec
