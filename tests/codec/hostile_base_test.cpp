// SPDX-License-Identifier: MIT
// Base packets that no encoder writes: connectivity, isolated vertices and exact coordinates that lie. Refused by name,
// and in a time that the packet's claims justify.
#include <gtest/gtest.h>

#include <bit>
#include <chrono>
#include <functional>

#include "codec/decoder.h"
#include "codec/lattice/ordered_float.h"
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

// Packet 0 of a mesh without faces and with one isolated vertex at lattice point `point`; then what `write` codes.
Bytes one_isolated_vertex(const Lattice& lattice, bool lossless, const LatticePoint& point,
                          const std::function<void(LyingSource&)>& write) {
  Bytes payload;
  append_base_header(payload, lattice, lossless);
  LyingSource source(payload, {});
  source.raw(0, 5);   // all digits
  source.raw(0, 1);   // no structure
  source.raw(0, 32);  // no component
  source.raw(1, 1);   // isolated vertices:
  source.raw(1, 32);  // one
  std::array<SignedModel, 3> models;
  for (std::size_t axis = 0; axis < 3; ++axis) models[axis].code(source, point[axis] - lattice.max_index() / 2);
  write(source);
  source.finish();
  PacketHeader header;
  header.last = true;
  header.vertices = 1;
  return forged_packet(header, payload);
}

ErrorCode refusal(const Bytes& packet) {
  Decoder decoder;
  const Result<Level> level = decoder.apply(packet);
  EXPECT_FALSE(level.ok());
  return level.ok() ? ErrorCode::internal_error : level.error().code;
}

TEST(HostileTail, IsolatedVertexBeyondTheLatticeIsCorrupt) {
  Lattice lattice;
  lattice.bits = 12;
  lattice.step = 1;
  auto nothing_more = [](LyingSource& source) { source.raw(0, 1); };
  // Within the lattice only the hash is wrong, which nobody can forge by this.
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, false, {0, 4095, 7}, nothing_more)), ErrorCode::hash_mismatch);
  for (const LatticePoint& point : {LatticePoint{-1, 0, 0}, LatticePoint{0, 4096, 0}, LatticePoint{0, 0, 1 << 29}}) {
    EXPECT_EQ(refusal(one_isolated_vertex(lattice, false, point, nothing_more)), ErrorCode::corrupt_data);
  }
}

TEST(HostileTail, ExactNumberBeyondItsCellIsCorrupt) {
  // All floats from 0 to the 2^24th above it lie in one cell: 2^24 + 1 of them, 2 raw bits below the leading number.
  Lattice lattice;
  lattice.bits = 12;
  auto exactness = [](std::uint32_t leading, std::uint32_t low) {
    return [leading, low](LyingSource& source) {
      source.raw(1, 1);
      for (int axis = 0; axis < 3; ++axis) {
        const double upper = axis == 0 ? from_ordered(1 << 24, Scalar::float32) : 0;
        for (double bound : {0.0, upper}) {
          const auto bits = std::bit_cast<std::uint64_t>(bound);
          source.raw(static_cast<std::uint32_t>(bits >> 32), 32);
          source.raw(static_cast<std::uint32_t>(bits & 0xFFFFFFFFu), 32);
        }
      }
      source.uniform(leading, (1u << 22) + 1);
      source.raw(low, 2);
    };
  };
  const LatticePoint origin{0, 0, 0};
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, origin, exactness(1u << 22, 0))), ErrorCode::hash_mismatch);
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, origin, exactness(77, 3))), ErrorCode::hash_mismatch);
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, origin, exactness(1u << 22, 1))), ErrorCode::corrupt_data);
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, origin, exactness(1u << 22, 3))), ErrorCode::corrupt_data);
  // In a mesh that is not lossless there is no exactness at all.
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, false, origin, exactness(77, 3))), ErrorCode::corrupt_data);
}

}  // namespace
}  // namespace pmcd::codec::testing
