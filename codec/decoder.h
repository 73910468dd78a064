// SPDX-License-Identifier: MIT
// The decoder's public face: packets in, levels out. Safe on hostile input: every packet is checked against the limits
// before anything is allocated, and a packet that is refused leaves the last good level as it was. No I/O, no threads,
// no exceptions; one object is used by one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "codec/lattice/lattice.h"
#include "codec/mesh/triangle_mesh.h"
#include "codec/result.h"

namespace pmcd::codec {

/// What a decoder may be made to hold. The defaults suit a desktop client.
struct DecoderLimits {
  std::uint32_t max_vertices = 100'000'000;
  std::uint32_t max_faces = 200'000'000;
  std::uint64_t max_packet_bytes = std::uint64_t{1} << 32;
};

/// What is known of a level once it stands.
struct Level {
  std::uint32_t level = 0;
  std::uint32_t vertices = 0;
  std::uint32_t faces = 0;
  bool last = false;  ///< nothing comes after it
};

class Decoder {
 public:
  explicit Decoder(const DecoderLimits& limits = {});
  ~Decoder();
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// Applies the next packet: packet 0 first, then each in its order. On error the decoder still stands at its last
  /// good level and takes the right packet later. Time and memory: linear in the level that results.
  Result<Level> apply(std::span<const std::byte> packet);

  /// True once packet 0 was applied.
  [[nodiscard]] bool has_level() const;
  /// REQUIRES: has_level(). The level that stands.
  [[nodiscard]] Level level() const;
  /// REQUIRES: has_level(). The lattice of the positions.
  [[nodiscard]] const Lattice& lattice() const;
  /// REQUIRES: has_level(). A copy of the level: vertices in decoding order (a vertex keeps its number from level to
  /// level), isolated vertices among them.
  [[nodiscard]] TriangleMesh mesh() const;

 private:
  struct State;
  DecoderLimits limits_;
  std::unique_ptr<State> state_;
};

}  // namespace pmcd::codec
