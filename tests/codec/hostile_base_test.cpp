// SPDX-License-Identifier: MIT
// Base packets that no encoder writes: connectivity, isolated vertices and exact coordinates that lie. Refused by name,
// and in a time that the packet's claims justify.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "codec/decoder.h"
#include "codec/exactness.h"
#include "tests/codec/forgery.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

using Bytes = std::vector<std::byte>;

// What a base packet says ahead of its mesh: no coordinates repeat, there is no reflection.
void write_structure(LyingSource& source) {
  source.raw(0, 2);
  source.raw(0, 1);
}

Bytes lying_base(std::uint32_t vertices, std::uint32_t faces, const std::function<BaseStep(std::uint32_t)>& beyond) {
  Bytes payload;
  Lattice lattice;
  lattice.bits = 12;
  lattice.step = 1.0 / 4095;
  append_base_header(payload, lattice, false);
  LyingSource source(payload, beyond);
  write_structure(source);
  LevelState state;
  state.lattice = lattice;
  (void)code_base_mesh(state, source, vertices, faces, 0);  // what it writes counts, not what it thinks of it
  source.raw(0, 2);                                         // no isolated vertices, no exactness
  source.finish();
  PacketHeader header;
  header.last = true;
  header.vertices = vertices;
  header.faces = faces;
  return forged_packet(header, payload);
}

TEST(HostileBase, MeshesThatAreNotManifoldAreRefused) {
  using enum BaseStep::Kind;
  // Three new vertices, then beyond every open edge what leaves the same known one: faces over faces.
  for (std::uint32_t known : {0u, 1u, 2u, 5u, 8u}) {
    std::uint32_t asked = 0;
    const Bytes packet = lying_base(50, 40, [&](std::uint32_t) {
      return ++asked < 4 ? BaseStep{new_vertex} : BaseStep{known_vertex, known};
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
    if (!of_hub || made == faces) return BaseStep{boundary};
    ++made;
    return BaseStep{new_vertex};
  });
  EXPECT_EQ(made, faces);
  EXPECT_LT(packet.size(), faces);
  Decoder decoder;
  const auto start = std::chrono::steady_clock::now();
  (void)decoder.apply(packet);  // refused for its hash at the latest
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// New vertices, then half-edges of one vertex again and again: as many wedges open at one vertex as can be.
TEST(HostileBase, PileOfWedgesIsReadInLinearTimeOrRefused) {
  using enum BaseStep::Kind;
  constexpr std::uint32_t kFaces = 60'000;
  std::uint32_t asked = 0;
  const Bytes packet = lying_base(kFaces, kFaces, [&](std::uint32_t) {
    // The face before attached to vertex 0 by its third half-edge, or its gate was the boundary.
    ++asked;
    return asked < kFaces / 3 || asked % 2 == 0 ? BaseStep{new_vertex} : BaseStep{known_vertex, 3 * asked - 1};
  });
  Decoder decoder;
  const auto start = std::chrono::steady_clock::now();
  const Result<Level> level = decoder.apply(packet);
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 12.0);
  ASSERT_FALSE(level.ok());
  EXPECT_NE(level.error().code, ErrorCode::internal_error);
}

// Whatever the bytes, the time is bounded by what the packet claims and how long it is.
TEST(HostileBase, RandomBytesAreRefusedSoon) {
  Random random(7);
  for (unsigned round = 0; round < 400; ++round) {
    Bytes payload;
    Lattice lattice;
    lattice.bits = 4 + round % 21;
    lattice.step = 0.001;
    append_base_header(payload, lattice, round % 2 == 1);
    const std::uint32_t bias = 1 + random.below(255);  // some streams lean towards zero bits, some towards ones
    for (std::uint32_t size = 8 + random.below(round < 390 ? 2000 : 60'000), i = 0; i < size; ++i) {
      payload.push_back(static_cast<std::byte>(random.below(256) & random.below(256) & bias));
    }
    PacketHeader header;
    header.last = true;
    header.vertices = 200'000;
    header.faces = 400'000;
    const Bytes packet = forged_packet(header, payload);
    Decoder decoder;
    const auto start = std::chrono::steady_clock::now();
    const Result<Level> level = decoder.apply(packet);
    EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 12.0) << round;
    ASSERT_FALSE(level.ok());
    EXPECT_NE(level.error().code, ErrorCode::internal_error);
  }
}

TEST(HostileBase, HugeFanIsReadInLinearTime) {
  for (const bool arriving : {false, true}) {
    const double small = seconds_for_fan(10'000, arriving);
    const double large = seconds_for_fan(40'000, arriving);
    EXPECT_LT(large, 0.3 + 8 * small) << "four times the faces took " << large / small << " times as long";
    EXPECT_LT(large, 12.0) << (arriving ? "arriving" : "leaving");
  }
}

// Packet 0 of a mesh without faces and with one isolated vertex at lattice point `point`; then what `write` codes.
Bytes one_isolated_vertex(const Lattice& lattice, bool lossless, const LatticePoint& point,
                          const std::function<void(LyingSource&)>& write) {
  Bytes payload;
  append_base_header(payload, lattice, lossless);
  LyingSource source(payload, {});
  write_structure(source);
  UnsignedModel().code(source, 0);  // no component
  source.raw(1, 1);                 // isolated vertices:
  source.raw(1, 32);                // one
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

// A lattice with 2^24 + 1 floats about zero in the cells of index 0: 2 raw bits below the leading number.
Lattice denormal_lattice() {
  Lattice lattice;
  lattice.bits = 12;
  lattice.step = std::ldexp(1.0, -125);
  return lattice;
}

struct LiedDecimals {
  std::uint32_t multiple = 1;
  std::int32_t exponent = 0;
  std::uint32_t digits = 0;
};

void write_form(LyingSource& source, const std::optional<LiedDecimals>& fine, const std::optional<LiedDecimals>& coarse,
                std::uint32_t repeats, std::uint32_t with_coarse, std::uint32_t strays,
                const std::optional<SteppedGrid>& grid = {}, std::uint32_t negated = 0) {
  source.raw(1, 1);
  for (const auto& decimals : {fine, coarse}) {
    source.raw(decimals ? 1 : 0, 1);
    if (!decimals) continue;
    source.raw(decimals->multiple, 3);
    source.raw(static_cast<std::uint16_t>(decimals->exponent), 16);
    source.raw(decimals->digits, 4);
  }
  if (!coarse) source.raw(grid ? 1 : 0, 1);
  if (grid) {
    for (double value : {grid->step, grid->origin[0], grid->origin[1], grid->origin[2]}) {
      const auto bits = std::bit_cast<std::uint64_t>(value);
      source.raw(static_cast<std::uint32_t>(bits >> 32), 32);
      source.raw(static_cast<std::uint32_t>(bits & 0xFFFFFFFFu), 32);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    source.raw(repeats, 1);
    if (repeats != 0) source.raw(negated, 1);
    source.raw(with_coarse, 1);
    source.raw(strays, 1);
  }
}

constexpr LatticePoint kOrigin{0, 0, 0};

TEST(HostileTail, ExactNumberBeyondItsCellIsCorrupt) {
  auto exactness = [](std::uint32_t leading, std::uint32_t low) {
    return [leading, low](LyingSource& source) {
      write_form(source, {}, {}, 0, 0, 0);
      for (int axis = 0; axis < 3; ++axis) {
        source.uniform(leading, (1u << 22) + 1);
        source.raw(low, 2);
      }
    };
  };
  const Lattice lattice = denormal_lattice();
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, kOrigin, exactness(1u << 22, 0))), ErrorCode::hash_mismatch);
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, kOrigin, exactness(77, 3))), ErrorCode::hash_mismatch);
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, kOrigin, exactness(1u << 22, 1))), ErrorCode::corrupt_data);
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, true, kOrigin, exactness(1u << 22, 3))), ErrorCode::corrupt_data);
  // In a mesh that is not lossless there is no exactness at all, and none where the lattice is exact.
  EXPECT_EQ(refusal(one_isolated_vertex(lattice, false, kOrigin, exactness(77, 3))), ErrorCode::corrupt_data);
  Lattice exact;
  exact.set_unit({1, 0}, {0, 0, 0});
  exact.exact = true;
  EXPECT_EQ(refusal(one_isolated_vertex(exact, true, kOrigin, exactness(0, 0))), ErrorCode::corrupt_data);
}

TEST(HostileTail, AbsurdDecimalsAreCorrupt) {
  const Lattice lattice = denormal_lattice();
  auto with = [&](const std::optional<LiedDecimals>& fine, const std::optional<LiedDecimals>& coarse,
                  std::uint32_t with_coarse) {
    return refusal(one_isolated_vertex(
        lattice, true, kOrigin, [&](LyingSource& source) { write_form(source, fine, coarse, 1, with_coarse, 0); }));
  };
  // One zero in each cell, so no number is coded: only the hash is wrong.
  EXPECT_EQ(with(LiedDecimals{1, -22, 15}, {}, 0), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(LiedDecimals{5, 22, 0}, LiedDecimals{0, -1000, 0}, 0), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(LiedDecimals{1, 23, 0}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with(LiedDecimals{1, -23, 6}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with(LiedDecimals{0, 1001, 0}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with(LiedDecimals{0, -32768, 0}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with(LiedDecimals{3, 0, 0}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with(LiedDecimals{7, 0, 0}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with(LiedDecimals{2, 0, 4}, {}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with({}, LiedDecimals{1, 1000, 0}, 0), ErrorCode::corrupt_data);
  EXPECT_EQ(with({}, {}, 1), ErrorCode::corrupt_data);  // coarse ones that are nowhere told
}

TEST(HostileTail, AbsurdGridsAreCorrupt) {
  const Lattice lattice = denormal_lattice();
  auto with = [&](double step, double origin, std::uint32_t with_coarse) {
    return refusal(one_isolated_vertex(lattice, true, kOrigin, [&](LyingSource& source) {
      write_form(source, LiedDecimals{1, 0, 0}, {}, 0, with_coarse, 0, SteppedGrid{step, {0, origin, 0}});
      std::array<AdaptiveBit, 3> coarse;
      for (AdaptiveBit& bit : coarse) source.bit(bit, true);
    }));
  };
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(with(1, 0, 1), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(1e308, 0, 1), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(std::numeric_limits<double>::denorm_min(), 0, 1), ErrorCode::corrupt_data);  // numbers were to follow
  for (double step : {0.0, -1.0, inf, std::nan("")}) EXPECT_EQ(with(step, 0, 1), ErrorCode::corrupt_data) << step;
  for (double origin : {-inf, inf, std::nan("")}) EXPECT_EQ(with(1, origin, 0), ErrorCode::corrupt_data) << origin;
}

TEST(HostileTail, NegatedMultiplesAreCorrupt) {
  auto with = [](const Lattice& lattice, std::uint32_t negated) {
    return refusal(one_isolated_vertex(lattice, true, kOrigin, [&](LyingSource& source) {
      write_form(source, LiedDecimals{1, -22, 15}, {}, 1, 0, 0, {}, negated);
    }));
  };
  EXPECT_EQ(with(denormal_lattice(), 0), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(denormal_lattice(), 1), ErrorCode::hash_mismatch);
  Lattice of_multiples;
  of_multiples.bits = 12;
  of_multiples.set_unit({1, 0}, {0, 0, 0});
  EXPECT_EQ(with(of_multiples, 1), ErrorCode::corrupt_data);
}

TEST(HostileTail, StraysBeyondTheFloatsAreCorrupt) {
  const Lattice lattice = denormal_lattice();
  auto with = [&](std::int64_t steps) {
    return refusal(one_isolated_vertex(lattice, true, kOrigin, [&](LyingSource& source) {
      write_form(source, LiedDecimals{1, 0, 0}, {}, 0, 0, 1);
      for (int axis = 0; axis < 3; ++axis) {
        StrayModel model;
        model.code(source, steps);
      }
    }));
  };
  EXPECT_EQ(with(0x7F7FFFFF), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(-0x7F800000), ErrorCode::hash_mismatch);
  EXPECT_EQ(with(0x7F800000), ErrorCode::corrupt_data);
  EXPECT_EQ(with(-0x7F800001), ErrorCode::corrupt_data);
  EXPECT_EQ(with(std::numeric_limits<std::int64_t>::max()), ErrorCode::corrupt_data);
  EXPECT_EQ(with(std::numeric_limits<std::int64_t>::min()), ErrorCode::corrupt_data);
}

}  // namespace
}  // namespace pmcd::codec::testing
