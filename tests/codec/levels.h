// SPDX-License-Identifier: MIT
// A stream's levels as LevelStates, for tests that look behind the Decoder's face. They go through the decoder's own
// functions and check no header: only for streams of our own encoder.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <span>
#include <vector>

#include "codec/base/base_mesh.h"
#include "codec/encoder.h"
#include "codec/exactness.h"
#include "codec/level_state.h"
#include "codec/packet/base_header.h"
#include "codec/packet/header.h"
#include "codec/refine.h"
#include "codec/source.h"
#include "codec/tail.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {

/// Nobody watches.
struct NoWatch {
  void inserted(const LevelState& /*state*/, std::uint32_t /*vertex*/) {}
  void coded(const LevelState& /*state*/, PacketPart /*part*/) {}
  void asked(const LevelState& /*state*/, std::uint32_t /*vertex*/) {}
};

/// A reader that tells `watch` of every insertion, of every vertex before its position is read, and of every part of
/// the packet after it was read.
template <typename Watch>
class WatchedReader : public PacketReader {
 public:
  WatchedReader(std::span<const std::byte> coded, const LevelState& state, Watch& watch)
      : PacketReader(coded), state_(state), watch_(watch) {}
  void told_inserted(std::uint32_t vertex) { watch_.inserted(state_, vertex); }
  void told_part(PacketPart part) { watch_.coded(state_, part); }
  [[nodiscard]] LatticePoint wanted_point(std::uint32_t vertex) const {
    watch_.asked(state_, vertex);
    return {};
  }

 private:
  const LevelState& state_;
  Watch& watch_;
};

/// Applies a packet to `state` (empty before the base packet). "": it went well.
template <typename Watch>
std::string apply_packet(std::span<const std::byte> packet, LevelState& state, Watch& watch) {
  const Result<PacketHeader> header = check_packet(packet);
  if (!header) return text(header.error());
  std::span<const std::byte> payload = packet.subspan(header->size);
  if (header->is_base()) {
    const Result<BaseHeader> base = parse_base_header(payload);
    if (!base) return text(base.error());
    state.lattice = base->lattice;
    state.lossless = base->lossless;
    payload = payload.subspan(base->size);
  }
  WatchedReader<Watch> reader(payload, state, watch);
  const LevelBounds bounds{header->vertices, header->faces};
  Status status = header->is_base() ? code_base_level(state, reader, bounds.vertices, bounds.faces)
                                    : code_passes(state, bounds, reader);
  if (status) status = code_isolated(state, bounds.vertices, reader);
  if (status) status = code_exactness(state, reader);
  if (!status) return text(status.error());
  if (reader.failed() || !reader.at_end()) return "the payload has another length";
  return {};
}

/// The levels of a mesh, coarse to fine.
template <typename Watch>
std::vector<LevelState> levels_of(const Encoded& encoded, Watch& watch) {
  std::vector<LevelState> levels;
  LevelState state;
  for (const EncodedPacket& packet : encoded.packets) {
    const std::string broken = apply_packet(std::span<const std::byte>(packet.bytes), state, watch);
    EXPECT_EQ(broken, "") << "level " << levels.size();
    if (!broken.empty()) break;
    levels.push_back(state);
  }
  return levels;
}

inline std::vector<LevelState> levels_of(const Encoded& encoded) {
  NoWatch watch;
  return levels_of(encoded, watch);
}

inline Encoded encoded_mesh(const TriangleMesh& mesh, const EncodeOptions& options) {
  Result<Encoded> result = encode(mesh, options);
  EXPECT_TRUE(result.ok()) << (result ? std::string() : text(result.error()));
  return result ? std::move(result).value() : Encoded{};
}

}  // namespace pmcd::codec::testing
