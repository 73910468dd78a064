// SPDX-License-Identifier: MIT
// Packets that no encoder writes, but with right magic, sizes and checksum: headers with claims of one's choice, and
// base meshes written by the codec's own functions from lies.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "codec/base/base_mesh.h"
#include "codec/entropy/integer_model.h"
#include "codec/entropy/range_coder.h"
#include "codec/level_state.h"
#include "codec/packet/base_header.h"
#include "codec/packet/header.h"
#include "codec/source.h"

namespace pmcd::codec::testing {

/// A packet of `header` (level, counts, hash, generation, last) around `payload`.
inline std::vector<std::byte> forged_packet(const PacketHeader& header, std::span<const std::byte> payload) {
  return make_packet(header, payload);
}

/// A payload for packet 0: a 12-bit float32 lattice over the unit cube, then what `write` codes.
inline std::vector<std::byte> base_payload(const std::function<void(RangeEncoder&)>& write,
                                           Structure structure = Structure::none) {
  Lattice lattice;
  lattice.bits = 12;
  lattice.step = 1.0 / 4095;
  std::vector<std::byte> payload;
  append_base_header(payload, lattice, false);
  RangeEncoder encoder(payload);
  encoder.raw(static_cast<std::uint32_t>(structure), 2);
  encoder.raw(0, 1);  // no reflection
  write(encoder);
  encoder.finish();
  return payload;
}

/// A number as the count of components is coded, at the start of a stream.
inline void write_count(RangeEncoder& encoder, std::uint32_t count) {
  struct Writer {
    RangeEncoder& encoder;
    bool bit(AdaptiveBit& model, bool value) const {
      encoder.bit(model, value);
      return value;
    }
    std::uint32_t raw(std::uint32_t value, unsigned bits) const {
      if (bits > 0) encoder.raw(value, bits);
      return value;
    }
  } writer{encoder};
  UnsignedModel().code(writer, count);
}

/// The Source that writes whatever it is told to: one component, whose growth `beyond` decides.
class LyingSource {
 public:
  LyingSource(std::vector<std::byte>& out, std::function<BaseStep(std::uint32_t halfedge)> beyond)
      : encoder_(out), beyond_(std::move(beyond)) {}

  bool bit(AdaptiveBit& model, bool value) {
    encoder_.bit(model, value);
    return value;
  }
  std::uint32_t raw(std::uint32_t value, unsigned count) {
    if (count > 0) encoder_.raw(value, count);
    return value;
  }
  std::uint32_t uniform(std::uint32_t value, std::uint32_t count) {
    encoder_.uniform(value, count);
    return value;
  }
  [[nodiscard]] static bool failed() { return false; }
  void finish() { encoder_.finish(); }

  [[nodiscard]] static std::uint32_t wanted_components() { return 1; }
  [[nodiscard]] static bool wanted_boundary() { return true; }
  [[nodiscard]] static std::vector<std::int32_t> wanted_values(std::size_t /*axis*/, unsigned /*shift*/) { return {}; }
  [[nodiscard]] BaseStep wanted_beyond(std::uint32_t halfedge) const { return beyond_(halfedge); }
  [[nodiscard]] static LatticePoint wanted_point(std::uint32_t /*vertex*/) { return {2047, 2047, 2047}; }
  void told_component(std::uint32_t /*component*/, std::uint32_t /*first_vertex*/, std::uint32_t /*face*/) {}
  void told_face(std::uint32_t /*beyond*/, std::uint32_t /*face*/, std::uint32_t /*vertex*/) {}
  void told_part(PacketPart /*part*/) {}

 private:
  RangeEncoder encoder_;
  std::function<BaseStep(std::uint32_t)> beyond_;
};

}  // namespace pmcd::codec::testing
