// SPDX-License-Identifier: MIT
// What vertices know of their surroundings: sums that are kept up to date move by move equal those made from nothing,
// bit for bit, at any position of decoding; normals are those of the faces when they were built; rings are what the
// mesh says.
#include "codec/geometry/surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "codec/geometry/provisional.h"
#include "codec/geometry/ring.h"
#include "codec/geometry/ring_walk.h"
#include "tests/codec/generated.h"
#include "tests/codec/levels.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

// The first vertex whose sums differ from those of a surface built from nothing; "": none.
std::string stale(const HalfEdgeMesh& mesh, const Surface& surface) {
  std::vector<LatticePoint> points;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) points.push_back(surface[v].point);
  Surface fresh;
  fresh.build(mesh, points, {});
  for (std::size_t v = 0; v < points.size(); ++v) {
    const char* what = nullptr;
    if (surface[v].sum != fresh[v].sum) what = "sum";
    if (surface[v].neighbours != fresh[v].neighbours) what = "number of neighbours";
    if (what != nullptr) return std::string(what) + " of vertex " + std::to_string(v);
  }
  return {};
}

// Keeps a surface as the decoder keeps its own, built once a packet and moved with every position, and looks at it
// before each.
struct StaleWatch {
  std::uint32_t every = 1;
  std::uint32_t turn = 0;
  std::uint32_t interior = 0;
  std::uint32_t border = 0;
  std::uint32_t ears = 0;
  std::uint32_t moves = 0;
  std::string broken;

  Surface surface;
  bool built = false;
  std::uint32_t inserted_in_packet = 0;
  std::uint32_t pending = kNone;  // this position is being read

  void check(const LevelState& state, const char* when, std::uint32_t vertex) {
    if (!broken.empty() || turn++ % every != 0) return;
    broken = stale(state.mesh, surface);
    if (!broken.empty()) broken += std::string(", ") + when + " " + std::to_string(vertex);
  }
  void inserted(const LevelState& state, std::uint32_t vertex) {
    ++inserted_in_packet;
    if (!state.mesh.is_boundary(vertex)) {
      ++interior;
    } else {
      ++(state.mesh.face_valence(vertex) == 1 ? ears : border);
    }
  }
  void settle(const LevelState& state) {
    if (pending == kNone) return;
    surface.move(state.mesh, collect_ring(state.mesh, pending), pending, state.points[pending]);
    check(state, "after the position of", pending);
    pending = kNone;
  }
  void asked(const LevelState& state, std::uint32_t vertex) {
    if (!built) return;  // the base mesh has no surface
    settle(state);
    pending = vertex;
    ++moves;
  }
  void coded(const LevelState& state, PacketPart part) {
    if (part == PacketPart::connectivity) {
      surface.build(state.mesh, state.points, state.spreads);
      built = true;
      check(state, "when built, vertex", 0);
      const std::uint32_t first = state.mesh.vertex_count() - inserted_in_packet;
      place_provisionally(state.mesh, surface, first, 2 * state.lattice.max_index());
      check(state, "when placed, vertex", first);
    }
    if (built && (part == PacketPart::geometry || part == PacketPart::precision)) settle(state);
  }
  void end_packet(const LevelState& state) {
    settle(state);
    if (!built) return;
    // Whoever was not moved came later (isolated), or was at its place already.
    for (std::uint32_t v = 0; v < state.mesh.vertex_count() && broken.empty(); ++v) {
      if (state.mesh.outgoing(v) == kNone) continue;
      if (surface[v].point != state.points[v]) broken = "vertex " + std::to_string(v) + " stands elsewhere";
    }
    built = false;
    inserted_in_packet = 0;
  }
};

void decode_watched(const TriangleMesh& mesh, const EncodeOptions& options, StaleWatch& watch) {
  const Encoded encoded = encoded_mesh(mesh, options);
  LevelState state;
  for (std::size_t k = 0; k < encoded.packets.size(); ++k) {
    state.level = static_cast<std::uint32_t>(k);
    ASSERT_EQ(apply_packet(std::span<const std::byte>(encoded.packets[k].bytes), state, watch), "") << "level " << k;
    watch.end_packet(state);
    ASSERT_EQ(watch.broken, "") << "level " << k;
  }
}

TEST(SurfaceTest, BuiltSumsAreWhatTheMeshSays) {
  Random random(1);
  for (const auto& [name, mesh] : zoo()) {
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(built.ok()) << name;
    std::vector<LatticePoint> points(mesh.positions.size());
    for (LatticePoint& p : points) {
      for (std::int32_t& c : p) c = static_cast<std::int32_t>(random.below(1u << 25));
    }
    Surface surface;
    surface.build(*built, points, {});
    for (std::uint32_t v = 0; v < points.size(); ++v) {
      std::array<std::int64_t, 3> sum{};
      std::uint32_t neighbours = 0;
      built->for_each_neighbour(v, [&](std::uint32_t w) {
        for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += points[w][axis];
        ++neighbours;
      });
      ASSERT_EQ(surface[v].neighbours, neighbours) << name;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_EQ(surface[v].sum[axis], static_cast<std::uint32_t>(sum[axis])) << name << " vertex " << v;
      }
    }
    std::vector<std::array<double, 3>> normals(points.size());
    std::vector<double> size(points.size());  // of all that was added
    for (const Face& face : mesh.faces) {
      std::array<std::array<double, 3>, 2> side{};
      for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          side[i][axis] = static_cast<double>(points[face[i + 1]][axis] - points[face[0]][axis]);
        }
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t j = (axis + 1) % 3;
        const std::size_t k = (axis + 2) % 3;
        const double part = side[0][j] * side[1][k] - side[0][k] * side[1][j];
        for (std::uint32_t v : face) {
          normals[v][axis] += part;
          size[v] += std::abs(part);
        }
      }
    }
    for (std::size_t v = 0; v < points.size(); ++v) {
      const auto& n = normals[v];
      const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double wanted = length > 0 ? n[axis] / length : 0;
        const double rounding = length > 0 ? 1e-5 * size[v] / length : 0;
        ASSERT_NEAR(surface[v].normal[static_cast<int>(axis)], wanted, rounding) << name << " vertex " << v;
      }
    }
  }
}

TEST(SurfaceTest, SumsHoldAtEveryStepOfDecoding) {
  StaleWatch watch;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    EncodeOptions options;
    options.bits = 8 + static_cast<unsigned>(seed);
    options.cleaning = seed % 3 == 0;
    if (seed % 4 == 0) options.effort = Effort::best;
    decode_watched(any_mesh(seed), options, watch);
    if (HasFatalFailure()) return;
  }
  Random random(2);
  TriangleMesh ragged = grid(12, 12, 3);
  split_faces(ragged, 30, random);
  jitter(ragged, 0.05, random);
  EncodeOptions options;
  options.bits = 12;
  decode_watched(ragged, options, watch);
  EXPECT_GT(watch.interior, 400u);
  EXPECT_GT(watch.border, 50u);
  EXPECT_GT(watch.ears, 0u);
  EXPECT_GT(watch.moves, watch.interior + watch.border);
}

TEST(SurfaceTest, SumsHoldInTheZooAndInManyMeshes) {
  StaleWatch watch;
  watch.every = 53;
  for (const auto& [name, mesh] : zoo()) {
    decode_watched(mesh, {}, watch);
    ASSERT_FALSE(HasFatalFailure()) << name;
  }
  for (std::uint64_t seed = 100; seed < 160; ++seed) {
    decode_watched(any_mesh(seed), {}, watch);
    ASSERT_FALSE(HasFatalFailure()) << seed;
  }
}

TEST(SurfaceTest, RandomMovesKeepTheSums) {
  Random random(3);
  for (const TriangleMesh& mesh : {sphere(2), grid(6, 5, 1), bipyramid(40), cone(30), single_triangle()}) {
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(built.ok());
    std::vector<LatticePoint> points(mesh.positions.size());
    Surface surface;
    surface.build(*built, points, {});
    for (int i = 0; i < 400; ++i) {
      const std::uint32_t v = random.below(points.size());
      LatticePoint to = points[v];
      for (std::int32_t& c : to) c = random.one_in(4) ? c : static_cast<std::int32_t>(random.below(1u << 25));
      points[v] = to;
      surface.move(*built, collect_ring(*built, v), v, to);
      ASSERT_EQ(surface[v].point, to);
      if (i % 20 == 19) {
        ASSERT_EQ(stale(*built, surface), "");
      }
    }
  }
}

bool same(Four a, Four b) {
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

TEST(SurfaceTest, NormalsStayUntilTheyAreBuiltAnew) {
  Random random(4);
  for (const TriangleMesh& mesh : {sphere(2), grid(6, 5, 1), bipyramid(40), single_triangle()}) {
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(built.ok());
    std::vector<LatticePoint> points(mesh.positions.size());
    for (LatticePoint& p : points) p = {static_cast<std::int32_t>(random.below(1u << 25)), 7, 9};
    Surface surface;
    surface.build(*built, points, {});
    const Surface before = surface;
    for (int i = 0; i < 100; ++i) {
      const std::uint32_t v = random.below(points.size());
      for (std::int32_t& c : points[v]) c = static_cast<std::int32_t>(random.below(1u << 25));
      surface.move(*built, collect_ring(*built, v), v, points[v]);
    }
    for (std::size_t v = 0; v < points.size(); ++v) ASSERT_TRUE(same(surface[v].normal, before[v].normal)) << v;
    Surface fresh;
    fresh.build(*built, points, {});
    surface.build_normals(*built);
    bool turned = false;
    for (std::size_t v = 0; v < points.size(); ++v) {
      ASSERT_TRUE(same(surface[v].normal, fresh[v].normal)) << v;
      turned = turned || !same(surface[v].normal, before[v].normal);
    }
    EXPECT_TRUE(turned);
  }
}

TEST(SurfaceTest, SpreadsThatAreKnownAreHandedOver) {
  const TriangleMesh mesh = single_triangle();
  const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, 3);
  ASSERT_TRUE(built.ok());
  const std::vector<RelativeSpread> known = {{0.5f, 0.25f}, {3, 1e-4f}};
  Surface surface;
  surface.build(*built, std::vector<LatticePoint>(3), known);
  for (std::size_t v = 0; v < 2; ++v) {
    EXPECT_EQ(surface[v].spread.tangential, known[v].tangential);
    EXPECT_EQ(surface[v].spread.across, known[v].across);
  }
  EXPECT_EQ(surface[2].spread.tangential, RelativeSpread().tangential);
  // What was guessed of the others stays too.
  surface[2].spread.tangential = 0.125f;
  surface.move(*built, collect_ring(*built, 1), 1, {4, 5, 6});
  surface.build(*built, std::vector<LatticePoint>(3), known);
  EXPECT_EQ(surface[1].spread.tangential, known[1].tangential);
  EXPECT_EQ(surface[2].spread.tangential, 0.125f);
}

TEST(SurfaceTest, VectorsAreTheSums) {
  const TriangleMesh mesh = single_triangle();
  const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, 3);
  ASSERT_TRUE(built.ok());
  std::vector<LatticePoint> points(3);
  points[mesh.faces[0][0]] = {0, 0, 0};
  points[mesh.faces[0][1]] = {6, 0, 0};
  points[mesh.faces[0][2]] = {0, 4, -3};
  Surface surface;
  surface.build(*built, points, {});
  const Site& corner = surface[mesh.faces[0][0]];
  auto expect_lanes = [](Four got, float x, float y, float z) {
    EXPECT_EQ(got[0], x);
    EXPECT_EQ(got[1], y);
    EXPECT_EQ(got[2], z);
    EXPECT_EQ(got[3], 0);
  };
  EXPECT_EQ(corner.normal[0], 0);
  EXPECT_FLOAT_EQ(corner.normal[1], 0.6f);
  EXPECT_FLOAT_EQ(corner.normal[2], 0.8f);
  expect_lanes(corner.neighbour_mean(four_words({0, 0, 0})), 3, 2, -1.5f);
  // From afar, on either side: differences are taken before anything is rounded.
  expect_lanes(corner.neighbour_mean(four_words({16776001, 16776001, -16776001})), -16775998, -16775999, 16775999.5f);
  expect_lanes(surface[mesh.faces[0][2]].seen_from(four_words({1, -2, 3})), -1, 6, -6);
  expect_lanes(surface[mesh.faces[0][1]].seen_from(four_words({16777215, 0, -16777215})), -16777209, 0, 16777215);
}

// Sums wrap around; seen from nearby they are right again.
TEST(SurfaceTest, SumsOfManyFarVerticesAreSeenRight) {
  const std::uint32_t sides = 500;
  const TriangleMesh mesh = bipyramid(sides);
  const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  ASSERT_TRUE(built.ok());
  const std::int32_t far = (1 << 25) - 2;
  std::vector<LatticePoint> points(mesh.positions.size(), {far, far - 8, 0});
  Surface surface;
  surface.build(*built, points, {});
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    const Four mean = surface[v].neighbour_mean(four_words({far, far, 100}));
    EXPECT_EQ(mean[0], 0);
    EXPECT_EQ(mean[1], -8);
    EXPECT_EQ(mean[2], -100);
  }
}

// The neighbours as the mesh lists them.
std::vector<std::uint32_t> neighbours(const HalfEdgeMesh& mesh, std::uint32_t v) {
  std::vector<std::uint32_t> all;
  mesh.for_each_neighbour(v, [&](std::uint32_t w) { all.push_back(w); });
  return all;
}

void expect_apexes(const HalfEdgeMesh& mesh, std::uint32_t centre, const Ring& ring) {
  const std::size_t edges = ring.border ? ring.size - 1 : ring.size;
  for (std::size_t i = 0; i < edges; ++i) {
    // The face of the ring edge that is not the centre's runs the other way.
    const std::uint32_t next =
        i + 1 == Ring::kMost && mesh.face_valence(centre) > Ring::kMost ? kNone : ring.vertex[ring.after(i)];
    if (next == kNone) continue;
    const std::uint32_t h = mesh.find_halfedge(next, ring.vertex[i]);
    EXPECT_EQ(ring.apex[i], h == kNone ? kNone : mesh.apex(h)) << centre << ", edge " << i;
  }
  if (ring.border) {
    EXPECT_EQ(ring.apex[ring.size - 1], kNone);
  }
}

TEST(RingTest, IsTheNeighboursInTurningOrder) {
  std::uint32_t borders = 0;
  std::uint32_t large = 0;
  for (const auto& [name, mesh] : zoo()) {
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(built.ok()) << name;
    for (std::uint32_t v = 0; v < built->vertex_count(); ++v) {
      if (built->outgoing(v) == kNone) continue;
      const Ring ring = collect_ring(*built, v);
      std::vector<std::uint32_t> wanted = neighbours(*built, v);
      // With so many faces the ring is cut, and nobody asks any more whether it was closed.
      const bool cut = built->face_valence(v) >= Ring::kMost;
      EXPECT_EQ(ring.border, built->is_boundary(v) && !cut) << name << " vertex " << v;
      wanted.resize(std::min(wanted.size(), Ring::kMost));
      ASSERT_EQ(std::vector<std::uint32_t>(ring.vertex.begin(), ring.vertex.begin() + ring.size), wanted) << name;
      expect_apexes(*built, v, ring);
      borders += ring.border ? 1 : 0;
      large += cut ? 1 : 0;
    }
  }
  EXPECT_GT(borders, 50u);
  EXPECT_GT(large, 0u);
}

TEST(RingWalkTest, MeetsTheRingsInTurn) {
  Surface surface;
  for (const auto& [name, mesh] : zoo()) {
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(built.ok()) << name;
    const std::uint32_t count = built->vertex_count();
    surface.build(*built, std::vector<LatticePoint>(count), {});
    for (const std::uint32_t first : {0u, count / 2, count}) {
      RingWalk<> rings(*built, surface, first, count);
      RingWalk<Apexes::left_out> bare(*built, surface, first, count);
      for (std::uint32_t v = first; v < count; ++v) {
        const Ring& ring = rings.next();
        ASSERT_EQ(bare.next().size, ring.size) << name << " vertex " << v;
        if (built->outgoing(v) == kNone) {
          ASSERT_EQ(ring.size, 0u) << name << " vertex " << v;
          continue;
        }
        const Ring wanted = collect_ring(*built, v);
        ASSERT_EQ(ring.size, wanted.size) << name << " vertex " << v;
        ASSERT_EQ(ring.border, wanted.border) << name << " vertex " << v;
        for (std::size_t i = 0; i < ring.size; ++i) {
          ASSERT_EQ(ring.vertex[i], wanted.vertex[i]) << name << " vertex " << v;
          ASSERT_EQ(ring.apex[i], wanted.apex[i]) << name << " vertex " << v;
        }
      }
    }
  }
}

TEST(RingTest, IsCutAtItsMost) {
  for (std::uint32_t sides : {3u, 11u, 12u, 13u, 40u}) {
    const TriangleMesh closed = bipyramid(sides);
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(closed.faces, closed.positions.size());
    ASSERT_TRUE(built.ok());
    std::uint32_t hubs = 0;
    for (std::uint32_t v = 0; v < built->vertex_count(); ++v) {
      if (built->face_valence(v) != sides) continue;
      ++hubs;
      const Ring ring = collect_ring(*built, v);
      EXPECT_EQ(ring.size, std::min<std::size_t>(sides, Ring::kMost));
      EXPECT_FALSE(ring.border);
      EXPECT_EQ(ring.after(ring.size - 1), 0u);
      EXPECT_EQ(ring.after(0), 1u);
      expect_apexes(*built, v, ring);
    }
    EXPECT_GE(hubs, 2u);
  }
}

TEST(RingTest, FanAtTheBorderHasOneMoreVertexThanFaces) {
  // A fan of `faces` faces around vertex 0, which is at the border.
  for (std::uint32_t faces : {1u, 2u, 10u, 11u, 12u, 13u, 30u}) {
    std::vector<Face> fan;
    for (std::uint32_t f = 0; f < faces; ++f) fan.push_back({0, f + 1, f + 2});
    const Result<HalfEdgeMesh> built = HalfEdgeMesh::build(fan, faces + 2);
    ASSERT_TRUE(built.ok());
    const Ring ring = collect_ring(*built, 0);
    EXPECT_EQ(ring.size, std::min<std::size_t>(faces + 1, Ring::kMost)) << faces;
    EXPECT_EQ(ring.border, faces < Ring::kMost) << faces;
    for (std::uint32_t i = 0; i < ring.size; ++i) {
      EXPECT_EQ(ring.vertex[i], i + 1);
      EXPECT_EQ(ring.apex[i], kNone);
    }
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
