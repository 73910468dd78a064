// SPDX-License-Identifier: MIT
// Whole meshes drawn at random: encode, decode every level, compare the last one with the original by a comparer that
// shares no code with prove().
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "codec/proof.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"
#include "tests/sanitized.h"

namespace pmcd::codec::testing {
namespace {

EncodeOptions any_options(std::uint64_t seed) {
  Random random(seed ^ 0x5DEECE66D);
  EncodeOptions options;
  if (!random.one_in(3)) options.bits = 4 + random.below(21);
  options.cleaning = random.one_in(2);
  if (random.one_in(3)) options.max_packets_after_base = 1 + random.below(20);
  if (random.one_in(3)) options.min_flip_cosine = 2 * random.unit() - 1;
  if (random.one_in(3)) options.max_shape_error = random.unit();
  if (random.one_in(3)) options.effort = Effort::best;
  return options;
}

std::string check(const TriangleMesh& mesh, const EncodeOptions& options) {
  Encoded encoded;
  std::string broken = round_trip(mesh, options, &encoded);
  if (!broken.empty()) return broken;
  if (options.max_packets_after_base && encoded.packets.size() > *options.max_packets_after_base + 1)
    return "too many packets";
  for (const EncodedPacket& packet : encoded.packets) {
    if (!check_packet(packet.bytes)) return "a packet does not stand for itself";
  }
  const Result<ParsedFile> file = parse_file(to_file(encoded.packets));
  if (!file) return "file: " + text(file.error());
  return {};
}

TEST(Properties, AnyMeshAnyOptions) {
  rc::check("encode and decode", [](std::uint64_t seed) {
    const std::string broken = check(any_mesh(seed), any_options(seed));
    if (!broken.empty()) RC_FAIL("seed " + std::to_string(seed) + ": " + broken);
  });
}

TEST(Properties, FixedSeeds) {
  for (std::uint64_t seed = 0; seed < test::rounds(700); ++seed) {
    ASSERT_EQ(check(any_mesh(seed), any_options(seed)), "") << "seed " << seed;
  }
}

TEST(Properties, ZooWithEveryKindOfOption) {
  for (const auto& [name, mesh] : zoo()) {
    for (const bool cleaning : {false, true}) {
      EncodeOptions options;
      options.cleaning = cleaning;
      options.effort = Effort::best;
      EXPECT_EQ(check(mesh, options), "") << name << ", lossless, with effort";
      options.effort = Effort::standard;
      EXPECT_EQ(check(mesh, options), "") << name << ", lossless";
      for (unsigned bits : {4u, 7u, 12u, 16u, 24u}) {
        if (test::kSanitized && bits != 12) continue;  // the others go the same ways
        options.bits = bits;
        EXPECT_EQ(check(mesh, options), "") << name << ", " << bits << " bits";
      }
    }
  }
}

TEST(Properties, EffortDoesNotMatterToTheResult) {
  rc::check("encode with effort and decode", [](std::uint64_t seed) {
    EncodeOptions options = any_options(seed);
    options.effort = Effort::best;
    const std::string broken = check(any_mesh(seed), options);
    if (!broken.empty()) RC_FAIL("seed " + std::to_string(seed) + ": " + broken);
  });
}

TEST(Properties, EveryNumberOfBits) {
  Random random(6);
  TriangleMesh mesh = joined(sphere(3), grid(8, 8, 2));
  jitter(mesh, 0.03, random);
  add_isolated(mesh, 9, random);
  for (unsigned bits = 4; bits <= 24; ++bits) {
    EncodeOptions options;
    options.bits = bits;
    EXPECT_EQ(check(mesh, options), "") << bits;
    EXPECT_EQ(check(as_float64(mesh, random), options), "") << bits << ", double";
  }
}

TEST(Properties, EveryNumberOfLevels) {
  Random random(7);
  TriangleMesh mesh = torus(20, 20);
  add_isolated(mesh, 4, random);
  for (unsigned levels = 1; levels <= 20; ++levels) {
    EncodeOptions options;
    options.max_packets_after_base = levels;
    EXPECT_EQ(check(mesh, options), "") << levels << " levels";
    options.bits = 12;
    options.cleaning = true;
    EXPECT_EQ(check(mesh, options), "") << levels << " levels, 12 bits, cleaning";
  }
}

TEST(Properties, NumberingOfTheInputDoesNotMatterToTheResult) {
  Random random(8);
  const TriangleMesh mesh = any_mesh(12);
  for (int i = 0; i < 10; ++i) {
    const TriangleMesh other = renumbered(mesh, random);
    TriangleMesh decoded;
    const Result<Encoded> encoded = encode(other, {});
    ASSERT_TRUE(encoded.ok());
    EXPECT_TRUE(prove(*encoded, other).ok());
    ASSERT_EQ(decode_levels(encoded->packets, decoded), "");
    EXPECT_EQ(difference(mesh, decoded), "");
  }
}

// The comparer itself must see what it is there for.
TEST(Comparer, SeesEverySmallDifference) {
  const TriangleMesh mesh = sphere(2);
  Random random(9);
  EXPECT_EQ(difference(mesh, renumbered(mesh, random)), "");
  auto changed = [&](auto change) {
    TriangleMesh other = mesh;
    change(other);
    return difference(mesh, other);
  };
  EXPECT_NE(changed([](auto& m) { m.positions[3][2] = -m.positions[3][2] * 1.5; }), "");
  EXPECT_NE(changed([](auto& m) {
              for (Position& p : m.positions) {
                for (double& x : p) x = x == 0 ? -x : x;
              }
            }),
            "");
  EXPECT_NE(changed([](auto& m) { std::swap(m.faces[5][0], m.faces[5][1]); }), "");
  EXPECT_NE(changed([](auto& m) { m.faces[5] = m.faces[6]; }), "");
  EXPECT_NE(changed([](auto& m) { m.faces.pop_back(); }), "");
  EXPECT_NE(changed([](auto& m) { m.positions.push_back({0, 0, 0}); }), "");
  EXPECT_NE(changed([](auto& m) { m.scalar = Scalar::float64; }), "");
}

}  // namespace
}  // namespace pmcd::codec::testing
