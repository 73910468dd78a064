// SPDX-License-Identifier: MIT
// Where decisions come from. Every decoding function takes a Source: the reader answers from a packet, the writer
// (encoder/plan_writer.h) answers from the encoder's records and writes what it answers. So there is one walk, one
// context and one prediction for both directions.
//
// A Source has
//   bool bit(AdaptiveBit&, bool value)          one decision under a model
//   bool bit_at(uint32 p0, bool value)          one decision whose bit is 0 with probability p0 / 2^16, 0 < p0 < 2^16
//   uint32 raw(uint32 value, unsigned count)    count <= 32 bits without a model
//   uint32 uniform(uint32 value, uint32 count)  a number below count (count < 2^24)
//   uint32 symbol(uint32 value, uint32 count, guess, cumulative)   a number below count under a distribution; `guess()`
//                                               answers where to look first (RangeDecoder::symbol)
//   bool failed()                               nothing read from here on means anything
// where `value` is what the encoder wants; the reader ignores it and every call answers what holds. And it has the
// wanted_...() questions, by which the shared functions ask the encoder what it wants, and the told_...() calls, by
// which they tell it how the decoder numbers things. To the reader these mean nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codec/conquest/conquest.h"
#include "codec/entropy/range_coder.h"
#include "codec/geometry/reflection.h"
#include "codec/geometry/structure.h"
#include "codec/lattice/cell.h"
#include "codec/lattice/exactness_form.h"
#include "codec/lattice/lattice.h"

namespace pmcd::codec {

/// What lies beyond a half-edge of the growing base mesh.
struct BaseStep {
  enum class Kind : std::uint8_t { boundary, known_vertex, new_vertex };
  Kind kind = Kind::boundary;
  // For known_vertex, in the decoder's numbers: the border half-edge next to which the new face comes to lie, leaving
  // or arriving at that vertex.
  std::uint32_t halfedge = kNone;
  bool arrives = false;
};

/// Whether the positions that are still to come in a packet are guessed, after the connectivity and before the
/// positions of each pass: 0.2 bits a vertex less, a third more time.
enum class Guessing : std::uint8_t { never = 0, often = 1 };

/// In a packet faces are clear (SymbolModel::set_clear) above some sevenths: 0, all are, to this, none.
inline constexpr std::uint32_t kNoneClear = 7;

/// What a stretch of a packet is about, for the encoder's account of bits.
enum class PacketPart : std::uint8_t { base, connectivity, geometry, precision, isolated, exactness };

class PacketReader {
 public:
  explicit PacketReader(std::span<const std::byte> coded) : decoder_(coded) {}

  bool bit(AdaptiveBit& model, bool /*value*/) { return decoder_.bit(model); }
  bool bit_at(std::uint32_t p0, bool /*value*/) { return decoder_.bit_at(p0); }
  std::uint32_t raw(std::uint32_t /*value*/, unsigned count) { return count == 0 ? 0 : decoder_.raw(count); }
  std::uint32_t uniform(std::uint32_t /*value*/, std::uint32_t count) { return decoder_.uniform(count); }
  template <typename Guess, typename Cumulative>
  std::uint32_t symbol(std::uint32_t /*value*/, std::uint32_t count, const Guess& guess, const Cumulative& cumulative) {
    return decoder_.symbol(count, guess, cumulative);
  }
  [[nodiscard]] bool failed() const { return decoder_.overrun(); }
  [[nodiscard]] bool at_end() const { return decoder_.at_end(); }

  [[nodiscard]] Guessing wanted_guessing() const { return Guessing::never; }
  [[nodiscard]] std::uint32_t wanted_clear() const { return 0; }
  [[nodiscard]] Structure wanted_structure() const { return Structure::none; }
  [[nodiscard]] Reflection wanted_reflection() const { return {}; }
  [[nodiscard]] std::uint32_t wanted_passes() const { return 0; }
  [[nodiscard]] PassKind wanted_pass_kind() const { return PassKind::decimating; }
  [[nodiscard]] bool wanted_ear(std::uint32_t /*edge_origin*/) const { return false; }
  [[nodiscard]] Symbol wanted_symbol() const { return kNull; }
  [[nodiscard]] LatticePoint wanted_point(std::uint32_t /*vertex*/) const { return {}; }
  [[nodiscard]] std::uint32_t wanted_components() const { return 0; }
  [[nodiscard]] bool wanted_boundary() const { return false; }
  [[nodiscard]] std::vector<std::int32_t> wanted_values(std::size_t /*axis*/, unsigned /*shift*/) const { return {}; }
  [[nodiscard]] BaseStep wanted_beyond(std::uint32_t /*halfedge*/) const { return {}; }
  [[nodiscard]] std::uint32_t wanted_isolated() const { return 0; }
  [[nodiscard]] LatticePoint wanted_isolated_point(std::uint32_t /*k*/) const { return {}; }
  [[nodiscard]] std::optional<ExactnessForm> wanted_exactness() const { return std::nullopt; }
  [[nodiscard]] bool wanted_exact(std::uint32_t /*vertex*/, std::size_t /*axis*/, double /*value*/) const {
    return false;
  }
  [[nodiscard]] bool wanted_in(std::uint32_t /*vertex*/, std::size_t /*axis*/, const Cell& /*cell*/) const {
    return false;
  }
  [[nodiscard]] std::uint64_t wanted_number(std::uint32_t /*vertex*/, std::size_t /*axis*/,
                                            const Cell& /*cell*/) const {
    return 0;
  }
  [[nodiscard]] std::int64_t wanted_stray(std::uint32_t /*vertex*/, std::size_t /*axis*/, double /*value*/) const {
    return 0;
  }
  void told_pass(std::uint32_t /*pass*/) {}
  void told_inserted(std::uint32_t /*vertex*/) {}
  void told_component(std::uint32_t /*component*/, std::uint32_t /*first_vertex*/, std::uint32_t /*face*/) {}
  void told_face(std::uint32_t /*beyond*/, std::uint32_t /*face*/, std::uint32_t /*vertex*/) {}
  void told_isolated(std::uint32_t /*k*/, std::uint32_t /*vertex*/) {}
  void told_part(PacketPart /*what was coded since the last call*/) {}

 private:
  RangeDecoder decoder_;
};

}  // namespace pmcd::codec
