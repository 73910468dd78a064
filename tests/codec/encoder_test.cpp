// SPDX-License-Identifier: MIT
// The encoder's options, progress, report and refusals, and how passes are grouped into packets.
#include "codec/encoder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "codec/encoder/grouping.h"
#include "codec/packet/header.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

EncodeOptions with_bits(unsigned bits) {
  EncodeOptions options;
  options.bits = bits;
  return options;
}

Encoded encoded(const TriangleMesh& mesh, const EncodeOptions& options) {
  Encoded result;
  EXPECT_EQ(round_trip(mesh, options, &result), "");
  return result;
}

void expect_refused(const TriangleMesh& mesh, const EncodeOptions& options, ErrorCode code, std::uint64_t where) {
  const Result<Encoded> result = encode(mesh, options);
  ASSERT_FALSE(result.ok());
  EXPECT_STREQ(error_name(result.error().code), error_name(code)) << result.error().detail;
  EXPECT_EQ(result.error().where, where) << result.error().detail;
}

TEST(EncoderRefusals, OptionsOutOfRange) {
  const TriangleMesh mesh = octahedron();
  for (unsigned bits : {0u, 3u, 25u, 4000000000u})
    expect_refused(mesh, with_bits(bits), ErrorCode::invalid_option, bits);
  for (unsigned levels : {0u, 1001u}) {
    EncodeOptions options;
    options.max_packets_after_base = levels;
    expect_refused(mesh, options, ErrorCode::invalid_option, levels);
  }
  for (double cosine : {-1.01, 1.01, std::nan("")}) {
    EncodeOptions options;
    options.min_flip_cosine = cosine;
    expect_refused(mesh, options, ErrorCode::invalid_option, 0);
  }
  for (double shape : {-0.1, std::nan("")}) {
    EncodeOptions options;
    options.max_shape_error = shape;
    expect_refused(mesh, options, ErrorCode::invalid_option, 0);
  }
}

TEST(EncoderRefusals, MeshesByNameAndPlace) {
  auto changed = [](auto change) {
    TriangleMesh mesh = octahedron();
    change(mesh);
    return mesh;
  };
  const EncodeOptions options;
  expect_refused(changed([](auto& m) { m.faces[3][1] = 6; }), options, ErrorCode::index_out_of_range, 3);
  expect_refused(changed([](auto& m) { m.positions[2][1] = std::nan(""); }), options, ErrorCode::non_finite_coordinate,
                 2);
  expect_refused(changed([](auto& m) { m.positions[5][0] = 0.1; }), options, ErrorCode::not_representable, 5);
  expect_refused(changed([](auto& m) { m.faces[4][1] = m.faces[4][0]; }), options, ErrorCode::repeated_index_in_face,
                 4);
  expect_refused(changed([](auto& m) { m.faces.push_back(m.faces[2]); }), options, ErrorCode::duplicate_face, 8);
  expect_refused(changed([](auto& m) { std::swap(m.faces[0][0], m.faces[0][1]); }), options, ErrorCode::opposing_faces,
                 4);
  expect_refused(changed([](auto& m) {
                   m.positions.push_back({3, 3, 3});
                   m.faces.push_back({0, 2, 6});
                 }),
                 options, ErrorCode::non_manifold_edge, 8);
  expect_refused(changed([](auto& m) {
                   m.positions.insert(m.positions.end(), {{3, 3, 3}, {4, 3, 3}});
                   m.faces.push_back({5, 6, 7});
                 }),
                 options, ErrorCode::non_manifold_vertex, 5);
}

TEST(EncoderProgress, NeverFallsReachesOneAndIsNotTooOften) {
  std::vector<double> seen;
  const Result<Encoded> result = encode(sphere(5), with_bits(12), [&](double fraction) {
    seen.push_back(fraction);
    return true;
  });
  ASSERT_TRUE(result.ok());
  ASSERT_GE(seen.size(), 10u);
  EXPECT_LE(seen.size(), 500u);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
  EXPECT_GE(seen.front(), 0);
  EXPECT_EQ(seen.back(), 1);
}

TEST(EncoderProgress, IsHeardForEveryMeshOfTheZoo) {
  for (const auto& [name, mesh] : zoo()) {
    std::vector<double> seen;
    const Result<Encoded> result = encode(mesh, {}, [&](double fraction) {
      seen.push_back(fraction);
      return true;
    });
    ASSERT_TRUE(result.ok()) << name << ": " << text(result.error());
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end())) << name;
    EXPECT_EQ(seen.back(), 1) << name;
  }
}

TEST(EncoderProgress, NoAtAnyCallCancels) {
  const TriangleMesh mesh = sphere(3);
  int calls = 0;
  ASSERT_TRUE(encode(mesh, {}, [&](double) { return ++calls > 0; }).ok());
  ASSERT_GT(calls, 5);
  for (int stop = 1; stop <= calls; ++stop) {
    int call = 0;
    const Result<Encoded> result = encode(mesh, {}, [&](double) { return ++call < stop; });
    ASSERT_FALSE(result.ok()) << "call " << stop;
    EXPECT_EQ(result.error().code, ErrorCode::cancelled);
    EXPECT_EQ(call, stop) << "nothing is asked after a no";
  }
}

TEST(EncoderReportTest, CountsTheInput) {
  Random random(3);
  TriangleMesh mesh = joined(joined(sphere(3), grid(10, 10, 0)), single_triangle());
  add_isolated(mesh, 7, random);
  const EncodeReport report = encoded(mesh, {}).report;
  EXPECT_EQ(report.components, 3u);
  EXPECT_EQ(report.isolated_vertices, 7u);
  EXPECT_EQ(report.boundary_edges, 40u + 3u);
  EXPECT_GT(report.passes, 3u);
  EXPECT_GT(report.gates, mesh.positions.size());
}

TEST(EncoderReportTest, BitsAddUpToThePayloads) {
  Random random(4);
  TriangleMesh mesh = sphere(4);
  jitter(mesh, 0.01, random);
  add_isolated(mesh, 50, random);
  for (const EncodeOptions& options : {EncodeOptions{}, with_bits(12)}) {
    const Encoded result = encoded(mesh, options);
    double payload_bits = 0;
    for (const EncodedPacket& packet : result.packets) payload_bits += 8.0 * check_packet(packet.bytes)->payload_bytes;
    const BitReport& bits = result.report.bits;
    const double sum = bits.base + bits.connectivity + bits.geometry + bits.precision + bits.exactness + bits.isolated;
    // The fixed base header is not in it, and each packet ends at a byte.
    EXPECT_NEAR(sum, payload_bits, 8.0 * 22 + 16.0 * static_cast<double>(result.packets.size()));
    EXPECT_GT(bits.base, 0);
    EXPECT_GT(bits.connectivity, 0);
    EXPECT_GT(bits.geometry, bits.connectivity);
    EXPECT_GT(bits.precision, 0);
    EXPECT_GT(bits.isolated, 0);
    EXPECT_EQ(bits.exactness > 0, !options.bits.has_value());
  }
}

TEST(EncoderTest, SameBytesEveryTime) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const TriangleMesh mesh = any_mesh(seed);
    const Encoded first = encoded(mesh, with_bits(11));
    const Encoded second = encoded(mesh, with_bits(11));
    ASSERT_EQ(first.packets.size(), second.packets.size());
    for (std::size_t k = 0; k < first.packets.size(); ++k) EXPECT_EQ(first.packets[k].bytes, second.packets[k].bytes);
  }
}

TEST(EncoderTest, OtherMeshOtherGeneration) {
  auto generation = [](const Encoded& e) { return check_packet(e.packets[0].bytes)->generation; };
  const Encoded mesh = encoded(sphere(2), with_bits(12));
  TriangleMesh moved = sphere(2);
  moved.positions[17][1] = 0.25;
  EXPECT_NE(generation(mesh), generation(encoded(moved, with_bits(12))));
  EXPECT_NE(generation(mesh), generation(encoded(sphere(2), with_bits(13))));
  EXPECT_NE(generation(mesh), generation(encoded(sphere(2), {})));
}

TEST(EncoderTest, CleaningStandsInTheStream) {
  EncodeOptions cleaning = with_bits(12);
  cleaning.cleaning = true;
  const Encoded plain = encoded(sphere(4), with_bits(12));
  const Encoded cleaned = encoded(sphere(4), cleaning);
  EXPECT_NE(plain.packets.back().bytes, cleaned.packets.back().bytes);
  EXPECT_NE(plain.report.gates, cleaned.report.gates);
  EXPECT_NE(plain.packets[1].vertices, cleaned.packets[1].vertices);
}

TEST(EncoderTest, LimitsChangeWhatIsRemovedAndNeverTheResult) {
  Random random(10);
  TriangleMesh mesh = sphere(4);
  jitter(mesh, 0.05, random);
  const Encoded free = [&] {
    EncodeOptions options = with_bits(12);
    options.min_flip_cosine = -1;
    return encoded(mesh, options);
  }();
  EncodeOptions strict = with_bits(12);
  strict.min_flip_cosine = 0.9;
  EncodeOptions smooth = with_bits(12);
  smooth.max_shape_error = 0.45;
  for (const EncodeOptions& options : {strict, smooth}) {
    const Encoded limited = encoded(mesh, options);
    EXPECT_GT(limited.report.gates, free.report.gates) << "every veto costs a null patch";
    EXPECT_LE(limited.packets[0].vertices, 80u) << "limits are given up rather than leave a fat base";
  }
}

TEST(EncoderTest, LevelsAreAtMostAsManyAsAsked) {
  for (const bool lossless : {false, true}) {
    for (unsigned levels = 1; levels <= 20; ++levels) {
      EncodeOptions options;
      if (!lossless) options.bits = 12;
      options.max_packets_after_base = levels;
      const Encoded result = encoded(sphere(4), options);
      EXPECT_LE(result.packets.size(), levels + 1);
      EXPECT_GE(result.packets.size(), std::min(levels, 4u)) << "far fewer than asked";
    }
  }
}

TEST(EncoderTest, UsualLevelsGrowByAboutTwo) {
  const Encoded result = encoded(sphere(5), with_bits(12));
  for (std::size_t k = 1; k < result.packets.size(); ++k) {
    const double growth = static_cast<double>(result.packets[k].vertices) / result.packets[k - 1].vertices;
    EXPECT_GE(growth, 1.3) << k;
    EXPECT_LE(growth, 3.0) << k;
  }
}

TEST(EncoderTest, LosslessEndsInAnExactnessPacket) {
  const Encoded result = encoded(sphere(3), {});
  ASSERT_GE(result.packets.size(), 3u);
  const std::size_t last = result.packets.size() - 1;
  EXPECT_EQ(result.packets[last].vertices, result.packets[last - 1].vertices);
  EXPECT_EQ(result.packets[last].faces, result.packets[last - 1].faces);
  EXPECT_LT(result.packets[last - 2].vertices, result.packets[last - 1].vertices);
}

TEST(EncoderTest, SmallMeshesAreOnePacketOrTwo) {
  for (const TriangleMesh& mesh : {single_triangle(), tetrahedron()}) {
    EXPECT_EQ(encoded(mesh, with_bits(12)).packets.size(), 1u);
    EXPECT_EQ(encoded(scaled(mesh, 1 / 3.0), {}).packets.size(), 2u);
    EXPECT_EQ(encoded(mesh, {}).packets.size(), 1u);  // whole numbers are a lattice: nothing to lift
  }
  EXPECT_EQ(encoded({}, {}).packets.size(), 1u);
  EXPECT_EQ(encoded({}, with_bits(4)).packets.size(), 1u);
}

// Two hubs that all other vertices touch: a walk around a hub for each removal would take minutes.
TEST(EncoderTest, HugeValenceIsNotQuadratic) {
  for (const TriangleMesh& mesh : {cone(20000), bipyramid(20000)}) {
    const Encoded result = encoded(mesh, with_bits(12));
    EXPECT_LE(result.packets[0].vertices, 100u);
  }
}

std::vector<std::uint32_t> passes_growing(std::uint32_t base, double factor, std::size_t count) {
  std::vector<std::uint32_t> after;
  double vertices = base;
  for (std::size_t i = 0; i < count; ++i) {
    vertices = std::ceil(vertices * factor);
    after.push_back(static_cast<std::uint32_t>(vertices));
  }
  return after;
}

TEST(Grouping, TakesEveryPassOnceAndGrowsWithinBounds) {
  for (double factor : {1.02, 1.1, 1.25, 1.38, 1.5, 1.9, 2.5, 3.5}) {
    for (std::size_t count : {1u, 2u, 3u, 7u, 20u, 45u}) {
      if (std::pow(factor, static_cast<double>(count)) > 1e7) continue;
      const std::vector<std::uint32_t> after = passes_growing(20, factor, count);
      const std::vector<std::uint32_t> groups = group_passes(20, after, std::nullopt);
      EXPECT_EQ(std::accumulate(groups.begin(), groups.end(), 0u), count);
      std::size_t pass = 0;
      double before = 20;
      for (std::size_t g = 0; g < groups.size(); ++g) {
        ASSERT_GT(groups[g], 0u);
        pass += groups[g];
        const double growth = after[pass - 1] / before;
        if (groups[g] > 1) {
          EXPECT_LE(growth, 2.8) << factor << " x " << count << ", group " << g;
        }
        // The coarsest group takes what is left over.
        if (g > 0 && after.back() <= 5000) {
          EXPECT_GE(growth, 1.74) << factor << " x " << count << ", group " << g;
        }
        before = after[pass - 1];
      }
    }
  }
}

TEST(Grouping, LargeMeshesHaveSevenGroupsIfThePassesSuffice) {
  for (double factor : {1.2, 1.3, 1.5, 2.2}) {
    for (std::size_t count : {5u, 7u, 9u, 15u, 30u}) {
      if (60 * std::pow(factor, static_cast<double>(count)) > 1e7) continue;
      const std::vector<std::uint32_t> after = passes_growing(60, factor, count);
      if (after.back() <= 5000) continue;
      EXPECT_GE(group_passes(60, after, std::nullopt).size(), std::min<std::size_t>(count, 7))
          << factor << " x " << count;
    }
  }
}

TEST(Grouping, NeverMoreThanWanted) {
  for (double factor : {1.05, 1.3, 1.7, 2.6}) {
    for (std::size_t count : {1u, 2u, 9u, 13u}) {
      const std::vector<std::uint32_t> after = passes_growing(24, factor, count);
      for (unsigned most = 1; most <= 20; ++most) {
        const std::vector<std::uint32_t> groups = group_passes(24, after, most);
        EXPECT_LE(groups.size(), most);
        EXPECT_GE(groups.size(), 1u);
        EXPECT_EQ(std::accumulate(groups.begin(), groups.end(), 0u), count);
        for (std::uint32_t group : groups) EXPECT_GT(group, 0u);
      }
    }
  }
}

TEST(Grouping, NoPassesNoGroups) {
  EXPECT_TRUE(group_passes(5, {}, std::nullopt).empty());
  EXPECT_TRUE(group_passes(0, {}, 3).empty());
}

}  // namespace
}  // namespace pmcd::codec::testing
