// SPDX-License-Identifier: MIT
// Base meshes that no encoder writes: connectivity that lies. Refused by name, and in a time that the packet's claims
// justify.
#include <gtest/gtest.h>

#include <chrono>
#include <functional>

#include "codec/decoder.h"
#include "tests/codec/forgery.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

using Bytes = std::vector<std::byte>;

Bytes lying_base(std::uint32_t vertices, std::uint32_t faces, const std::function<BaseStep(std::uint32_t)>& beyond) {
  Bytes payload;
  Lattice lattice;
  lattice.bits = 12;
  lattice.step = 1.0 / 4095;
  append_base_header(payload, lattice, false);
  LyingSource source(payload, beyond);
  LevelState state;
  state.lattice = lattice;
  (void)code_base_mesh(state, source, vertices, faces);  // what it writes counts, not what it thinks of it
  source.raw(0, 2);                                      // no isolated vertices, no exactness
  source.finish();
  PacketHeader header;
  header.last = true;
  header.vertices = vertices;
  header.faces = faces;
  return forged_packet(header, payload);
}

TEST(HostileBase, MeshesThatAreNotManifoldAreRefused) {
  using enum BaseStep::Kind;
  // Beyond every open edge the same known vertex: faces over faces.
  for (std::uint32_t known : {0u, 1u, 2u}) {
    std::uint32_t asked = 0;
    const Bytes packet = lying_base(50, 40, [&](std::uint32_t) {
      return ++asked < 3 ? BaseStep{new_vertex, 0} : BaseStep{known_vertex, known};
    });
    Decoder decoder;
    const Result<Level> level = decoder.apply(packet);
    ASSERT_FALSE(level.ok());
    EXPECT_EQ(level.error().code, ErrorCode::corrupt_data) << text(level.error());
    EXPECT_FALSE(decoder.has_level());
  }
}

// One hub, all faces around it, in a packet of a few kilobytes: no step may look at all of the hub's edges. The fan
// grows across the half-edges that leave the hub, or across those that arrive there.
double seconds_for_fan(std::uint32_t faces, bool arriving) {
  using enum BaseStep::Kind;
  std::uint32_t made = 1;
  const Bytes packet = lying_base(faces + 2, faces, [&](std::uint32_t h) {
    const bool of_hub = arriving ? h % 3 == 2 : h == 0 || (h > 2 && h % 3 == 1);
    if (!of_hub || made == faces) return BaseStep{boundary, 0};
    ++made;
    return BaseStep{new_vertex, 0};
  });
  EXPECT_EQ(made, faces);
  EXPECT_LT(packet.size(), faces);
  Decoder decoder;
  const auto start = std::chrono::steady_clock::now();
  (void)decoder.apply(packet);  // refused for its hash at the latest
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// A strip of new vertices, then vertex 0 again and again: as many wedges open at one vertex as can be.
TEST(HostileBase, PileOfWedgesIsReadInLinearTimeOrRefused) {
  using enum BaseStep::Kind;
  constexpr std::uint32_t kFaces = 60'000;
  std::uint32_t asked = 0;
  const Bytes packet = lying_base(kFaces, kFaces, [&](std::uint32_t) {
    return ++asked < kFaces / 3 ? BaseStep{new_vertex, 0} : BaseStep{known_vertex, 0};
  });
  Decoder decoder;
  const auto start = std::chrono::steady_clock::now();
  const Result<Level> level = decoder.apply(packet);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 2.0);
  ASSERT_FALSE(level.ok());
  EXPECT_NE(level.error().code, ErrorCode::internal_error);
}

TEST(HostileBase, HugeFanIsReadInLinearTime) {
  for (const bool arriving : {false, true}) {
    const double small = seconds_for_fan(10'000, arriving);
    const double large = seconds_for_fan(40'000, arriving);
    EXPECT_LT(large, 0.3 + 8 * small) << "four times the faces took " << large / small << " times as long";
    EXPECT_LT(large, 2.0) << (arriving ? "arriving" : "leaving");
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
