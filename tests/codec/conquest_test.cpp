// SPDX-License-Identifier: MIT
// The retriangulation table against the paper's, patches there and back, what legality lets pass against brute force,
// and a conquest's invariants.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "codec/conquest/conquest.h"
#include "codec/conquest/ears.h"
#include "codec/conquest/hypothesis.h"
#include "codec/conquest/legality.h"
#include "codec/conquest/patch.h"
#include "codec/conquest/triangulation.h"
#include "codec/encoder.h"
#include "codec/encoder/decimation.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

constexpr Tag kP = Tag::plus;
constexpr Tag kM = Tag::minus;
using Diagonals = std::set<std::pair<unsigned, unsigned>>;

Diagonals diagonals_of(const Triangulation& t) {
  std::multiset<std::pair<unsigned, unsigned>> seen;
  for (unsigned k = 0; k < t.triangles; ++k) {
    for (unsigned e = 0; e < 3; ++e) {
      const unsigned a = t.corner[k][e];
      const unsigned b = t.corner[k][(e + 1) % 3];
      if (t.ring_edge[k][e] == Triangulation::kDiagonal) seen.insert({std::min(a, b), std::max(a, b)});
    }
  }
  Diagonals diagonals(seen.begin(), seen.end());
  for (const auto& d : diagonals) EXPECT_EQ(seen.count(d), 2u) << "a diagonal has two sides";
  return diagonals;
}

// That it cuts a convex polygon into triangles that turn the same way, and that a walk can follow its steps.
void expect_whole(const Triangulation& t, unsigned size) {
  ASSERT_EQ(t.size, size);
  ASSERT_EQ(t.triangles, size - 2);
  const std::array<std::array<double, 2>, 6> hexagon = {{{2, 0}, {1, 2}, {-1, 2}, {-2, 0}, {-1, -2}, {1, -2}}};
  auto area = [&](unsigned a, unsigned b, unsigned c) {
    return ((hexagon[b][0] - hexagon[a][0]) * (hexagon[c][1] - hexagon[a][1]) -
            (hexagon[c][0] - hexagon[a][0]) * (hexagon[b][1] - hexagon[a][1])) /
           2;
  };
  double whole = 0;
  double sum = 0;
  for (unsigned i = 1; i + 1 < size; ++i) whole += area(0, i, i + 1);
  std::set<unsigned> ring_edges;
  for (unsigned k = 0; k < t.triangles; ++k) {
    const double a = area(t.corner[k][0], t.corner[k][1], t.corner[k][2]);
    EXPECT_GT(a, 0);
    sum += a;
    for (unsigned e = 0; e < 3; ++e) {
      const unsigned from = t.corner[k][e];
      const bool on_ring = t.corner[k][(e + 1) % 3] == (from + 1) % size;
      EXPECT_EQ(t.ring_edge[k][e], on_ring ? from : Triangulation::kDiagonal);
      EXPECT_EQ(on_ring, on_ring && ring_edges.insert(from).second) << "a ring edge twice";
    }
    const Triangulation::Step& step = t.step[k];
    if (k == 0) {
      EXPECT_EQ(t.ring_edge[0][step.entry_edge], size - 1) << "the gate's triangle comes first";
      continue;
    }
    ASSERT_LT(step.from_triangle, k);
    EXPECT_EQ(t.corner[step.from_triangle][step.from_edge], t.corner[k][(step.entry_edge + 1) % 3]);
    EXPECT_EQ(t.corner[step.from_triangle][(step.from_edge + 1) % 3], t.corner[k][step.entry_edge]);
  }
  EXPECT_DOUBLE_EQ(sum, whole);
  EXPECT_EQ(ring_edges.size(), size);
}

TEST(TriangulationTable, IsThatOfThePaper) {
  struct Entry {
    unsigned size;
    Tag s;
    Tag t;
    std::vector<Tag> tags;  // of v1 .. v(size - 2)
    Diagonals diagonals;
  };
  const std::vector<Entry> table = {
      {3, kP, kM, {kP}, {}},
      {3, kM, kP, {kP}, {}},
      {3, kM, kM, {kP}, {}},
      {3, kP, kP, {kM}, {}},
      {4, kP, kM, {kP, kM}, {{1, 3}}},
      {4, kM, kM, {kP, kM}, {{1, 3}}},
      {4, kM, kP, {kM, kP}, {{0, 2}}},
      {4, kP, kP, {kM, kP}, {{0, 2}}},
      {5, kP, kM, {kP, kM, kP}, {{1, 4}, {1, 3}}},
      {5, kM, kM, {kP, kM, kP}, {{1, 4}, {1, 3}}},
      {5, kM, kP, {kP, kM, kP}, {{0, 3}, {1, 3}}},
      {5, kP, kP, {kM, kP, kM}, {{0, 2}, {2, 4}}},
      {6, kP, kM, {kP, kM, kP, kM}, {{1, 5}, {1, 3}, {3, 5}}},
      {6, kM, kM, {kP, kM, kP, kM}, {{1, 5}, {1, 3}, {3, 5}}},
      {6, kM, kP, {kM, kP, kM, kP}, {{0, 2}, {2, 4}, {0, 4}}},
      {6, kP, kP, {kM, kP, kM, kP}, {{0, 2}, {2, 4}, {0, 4}}},
  };
  for (const Entry& entry : table) {
    SCOPED_TRACE(std::to_string(entry.size) + (entry.s == kP ? " +" : " -") + (entry.t == kP ? "+" : "-"));
    const Triangulation& t = interior_triangulation(entry.size, entry.s, entry.t);
    expect_whole(t, entry.size);
    EXPECT_EQ(diagonals_of(t), entry.diagonals);
    for (unsigned i = 0; i < entry.tags.size(); ++i) EXPECT_EQ(t.tag[i + 1], entry.tags[i]) << "v" << i + 1;
  }
}

TEST(TriangulationTable, BorderPatchesCutFromAOrFromM1) {
  for (unsigned closing = 0; closing < 2; ++closing) {
    for (Tag tag : {kP, kM}) {
      const Triangulation& three = border_triangulation(3, closing, tag);
      expect_whole(three, 3);
      for (unsigned i = 0; i < 3; ++i) EXPECT_EQ(three.tag[i], kP);
    }
  }
  for (unsigned closing = 0; closing < 3; ++closing) {
    const unsigned a = closing + 1;
    const unsigned m1 = (a + 1) % 4;
    const unsigned m2 = (a + 2) % 4;
    const unsigned b = closing;
    for (Tag tag_t : {kP, kM}) {
      const Triangulation& t = border_triangulation(4, closing, tag_t);
      expect_whole(t, 4);
      const auto [from, to] = tag_t == kM ? std::pair{a, m2} : std::pair{m1, b};
      EXPECT_EQ(diagonals_of(t), (Diagonals{{std::min(from, to), std::max(from, to)}}));
      for (unsigned i = 0; i < 4; ++i) EXPECT_EQ(t.tag[i], i == from || i == to ? kP : kM);
    }
  }
}

TEST(TriangulationTable, EveryBorderPatchHasASymbolOfItsOwn) {
  std::set<Symbol> symbols = {kNull, 3, 4, 5, 6, kImpossible};
  for (unsigned size : {3u, 4u}) {
    for (unsigned closing = 0; closing + 1 < size; ++closing) {
      EXPECT_TRUE(symbols.insert(border_symbol(size, closing)).second);
      EXPECT_LT(border_symbol(size, closing), kBorder + kBorderSymbols);
    }
  }
}

std::size_t boundary_edges(const HalfEdgeMesh& mesh) {
  std::size_t count = 0;
  for (std::uint32_t f = 0; f < mesh.face_count(); ++f) count += mesh.is_free_slot(f) ? 0 : mesh.boundary_edges(f);
  return count;
}

struct Tally {
  std::array<int, 7> interior{};
  std::array<int, 5> border{};
  int illegal = 0;
};

// One star, one pair of tags: out and in again, each step checked against lists of faces.
void there_and_back(const HalfEdgeMesh& before, std::uint32_t gate, Tag tag_s, Tag tag_t, Tally& tally) {
  Patch star;
  if (!collect_star(before, gate, star)) return;
  ASSERT_EQ(star.centre, before.apex(gate));
  ASSERT_EQ(star.ring[0], before.target(gate));
  ASSERT_EQ(star.ring[star.size - 1], before.origin(gate));
  const Triangulation& t = star.is_border() ? border_triangulation(star.size, star.closing, tag_t)
                                            : interior_triangulation(star.size, tag_s, tag_t);
  // The faces that must result, by brute force.
  std::vector<Face> faces;
  for (std::uint32_t f = 0; f < before.face_count(); ++f) {
    const Face face = before.face(f);
    if (std::find(face.begin(), face.end(), star.centre) == face.end()) faces.push_back(face);
  }
  ASSERT_EQ(before.face_count() - faces.size(), star.star_faces());
  for (unsigned k = 0; k < t.triangles; ++k) {
    faces.push_back({star.ring[t.corner[k][0]], star.ring[t.corner[k][1]], star.ring[t.corner[k][2]]});
  }
  const Result<HalfEdgeMesh> wanted = HalfEdgeMesh::build(faces, before.vertex_count());
  const bool same_topology =
      wanted.ok() && boundary_edges(*wanted) + (star.is_border() ? 1 : 0) == boundary_edges(before);
  if (!keeps_manifold(before, star, t)) {
    ++tally.illegal;
    EXPECT_FALSE(same_topology) << "a veto without a reason: vertex " << star.centre;
    return;
  }
  ASSERT_TRUE(same_topology) << "removing vertex " << star.centre << " breaks the mesh";

  HalfEdgeMesh mesh = before;
  remove_centre(mesh, star, t);
  ASSERT_EQ(complaint(mesh), "");
  ASSERT_EQ(sorted_faces(mesh), sorted_faces(faces));
  ASSERT_EQ(mesh.outgoing(star.centre), kNone);

  const std::uint32_t gate_now = mesh.find_halfedge(star.ring[star.size - 1], star.ring[0]);
  ASSERT_NE(gate_now, kNone);
  std::vector<std::uint8_t> marks(mesh.face_count(), 0);
  Patch polygon;
  ASSERT_TRUE(collect_polygon(mesh, gate_now, t, star.closing, marks, polygon));
  EXPECT_EQ(polygon.size, star.size);
  EXPECT_EQ(polygon.slot_count, star.polygon_faces());
  for (unsigned i = 0; i < star.size; ++i) {
    ASSERT_EQ(polygon.ring[i], star.ring[i]);
    // The outside of the gate and of all other ring edges did not change.
    if (i != star.closing) {
      ASSERT_EQ(polygon.outside[i], star.outside[i]);
    }
  }
  for (unsigned k = 0; k < polygon.slot_count; ++k) {
    marks[polygon.slots[k]] = 1;
    Patch conquered;
    EXPECT_FALSE(collect_polygon(mesh, gate_now, t, star.closing, marks, conquered));
    marks[polygon.slots[k]] = 0;
  }
  insert_centre(mesh, polygon, t, star.centre);
  ASSERT_EQ(complaint(mesh), "");
  ASSERT_EQ(sorted_faces(mesh), sorted_faces(before));
  EXPECT_EQ(polygon.slot_count, star.star_faces());
  ++(star.is_border() ? tally.border[star.size] : tally.interior[star.size]);
}

TEST(PatchTest, OutAndInGivesTheSameMesh) {
  Random random(77);
  std::vector<TriangleMesh> meshes = {octahedron(),  tetrahedron(), facing_threes(), single_triangle(),
                                      grid(6, 5, 1), grid(1, 4, 0), grid(2, 2, 0),   cone(4),
                                      cone(7),       bipyramid(5),  torus(3, 4),     holed_plate(1, 1)};
  for (int i = 0; i < 6; ++i) {
    TriangleMesh mesh = i % 2 == 0 ? grid(6, 6, 3) : sphere(2);
    split_faces(mesh, 15, random);
    flip_edges(mesh, 120, random);
    meshes.push_back(renumbered(mesh, random));
  }
  Tally tally;
  for (const TriangleMesh& mesh : meshes) {
    const Result<HalfEdgeMesh> links = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(links.ok());
    for (std::uint32_t i = 0; i < 3 * links->face_count(); ++i) {
      const std::uint32_t gate = HalfEdgeMesh::halfedge(i / 3, i % 3);
      for (Tag s : {kP, kM}) {
        for (Tag t : {kP, kM}) there_and_back(*links, gate, s, t, tally);
        if (HasFatalFailure()) return;
      }
    }
  }
  // Every kind of patch was met, and vetoes.
  for (unsigned size = 3; size <= 6; ++size) EXPECT_GT(tally.interior[size], 100) << size;
  for (unsigned size = 3; size <= 4; ++size) EXPECT_GT(tally.border[size], 50) << size;
  EXPECT_GT(tally.illegal, 100);
}

TEST(PatchTest, NoStarOfOtherValences) {
  Patch patch;
  const TriangleMesh hub = bipyramid(7);
  const Result<HalfEdgeMesh> seven = HalfEdgeMesh::build(hub.faces, hub.positions.size());
  ASSERT_TRUE(seven.ok());
  EXPECT_FALSE(collect_star(*seven, seven->find_halfedge(1, 2), patch));  // front vertex 0, valence 7
  const Result<HalfEdgeMesh> one = HalfEdgeMesh::build(single_triangle().faces, 3);
  ASSERT_TRUE(one.ok());
  for (std::uint32_t h = 0; h < 3; ++h) EXPECT_FALSE(collect_star(*one, h, patch));  // an ear
}

// A ring of six around the origin, alternately at the given radii and heights, and its centre at `height`.
struct Star {
  HalfEdgeMesh mesh;
  std::vector<LatticePoint> points;
  Patch patch;
};

Star star_of(const std::vector<LatticePoint>& ring, const LatticePoint& centre) {
  const auto n = static_cast<std::uint32_t>(ring.size());
  std::vector<Face> faces;
  for (std::uint32_t i = 0; i < n; ++i) faces.push_back({i, (i + 1) % n, n});
  Star star;
  Result<HalfEdgeMesh> mesh = HalfEdgeMesh::build(faces, n + 1);
  EXPECT_TRUE(mesh.ok());
  star.mesh = std::move(mesh).value();
  star.points = ring;
  star.points.push_back(centre);
  EXPECT_TRUE(collect_star(star.mesh, star.mesh.find_halfedge(n - 1, 0), star.patch));
  return star;
}

TEST(KeepsShape, ConvexFlatPatchesPassAnyLimit) {
  const Star star = star_of(
      {{100, 0, 50}, {50, 100, 50}, {-50, 100, 50}, {-100, 0, 50}, {-50, -100, 50}, {50, -100, 50}}, {3, 4, 50});
  for (Tag t : {kP, kM}) {
    EXPECT_TRUE(keeps_shape(star.points, star.patch, interior_triangulation(6, kP, t), {0.999, 0.0}));
  }
}

TEST(KeepsShape, FlippedFaceIsVetoedByTheCosineAlone) {
  // A dart: the diagonal 0-2 lies outside, so one of its triangles turns over; 1-3 is fine.
  const Star star = star_of({{0, 0, 0}, {100, -100, 0}, {30, 0, 0}, {100, 100, 0}}, {20, 0, 0});
  const Triangulation& across = interior_triangulation(4, kM, kM);  // v1-s
  const Triangulation& along = interior_triangulation(4, kP, kP);   // t-v2
  const bool across_ok = keeps_shape(star.points, star.patch, across, {-0.3, std::nullopt});
  const bool along_ok = keeps_shape(star.points, star.patch, along, {-0.3, std::nullopt});
  EXPECT_NE(across_ok, along_ok);
  EXPECT_TRUE(keeps_shape(star.points, star.patch, across, {-1, std::nullopt}));
  EXPECT_TRUE(keeps_shape(star.points, star.patch, along, {-1, std::nullopt}));
}

TEST(KeepsShape, ShapeLimitIsTheCubeRootOfTheVolumeByMeanRingEdge) {
  // A pyramid over a square of side 200, height 60: V = 200 * 200 * 60 / 3.
  const Star star = star_of({{100, 100, 0}, {-100, 100, 0}, {-100, -100, 0}, {100, -100, 0}}, {0, 0, 60});
  const double error = std::cbrt(200.0 * 200 * 60 / 3) / 200;
  for (Tag t : {kP, kM}) {
    const Triangulation& triangulation = interior_triangulation(4, t, t);
    EXPECT_TRUE(keeps_shape(star.points, star.patch, triangulation, {-1, error * 1.001}));
    EXPECT_FALSE(keeps_shape(star.points, star.patch, triangulation, {-1, error * 0.999}));
  }
}

TEST(KeepsShape, ZeroAreaDoesNotVeto) {
  const Star star = star_of({{5, 5, 5}, {5, 5, 5}, {5, 5, 5}, {5, 5, 5}}, {5, 5, 5});
  EXPECT_TRUE(keeps_shape(star.points, star.patch, interior_triangulation(4, kP, kM), {0.5, 0.0}));
}

TEST(Seeds, OneAComponentAlongItsFirstFace) {
  TriangleMesh mesh = joined(joined(sphere(1), single_triangle()), grid(3, 3, 0));
  Random random(1);
  add_isolated(mesh, 5, random);
  const Result<HalfEdgeMesh> links = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  ASSERT_TRUE(links.ok());
  const std::vector<Seed> seeds = choose_seeds(*links);
  ASSERT_EQ(seeds.size(), 3u);
  const std::array<std::size_t, 3> first_face = {0, sphere(1).faces.size(), sphere(1).faces.size() + 1};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(seeds[i].s, mesh.faces[first_face[i]][0]);
    EXPECT_EQ(seeds[i].t, mesh.faces[first_face[i]][1]);
  }
}

TEST(Ears, OutAndInGivesTheSameMesh) {
  int ears = 0;
  for (const TriangleMesh& shape : {grid(1, 1, 0), grid(5, 5, 1), grid(1, 9, 0), cone(5), grid(3, 1, 0)}) {
    TriangleMesh mesh = shape;
    Random random(4);
    flip_edges(mesh, 20, random);
    const Result<HalfEdgeMesh> before = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(before.ok());
    for (std::uint32_t x = 0; x < before->vertex_count(); ++x) {
      if (before->face_valence(x) != 1) continue;
      const std::uint32_t from_x = before->outgoing(x);
      const std::uint32_t a = before->apex(from_x);
      const std::uint32_t b = before->target(from_x);
      if (before->face_valence(a) < 2 || before->face_valence(b) < 2) continue;
      ++ears;
      HalfEdgeMesh links = *before;
      remove_ear(links, x);
      ASSERT_EQ(complaint(links), "");
      std::vector<Face> without;
      for (const Face& f : mesh.faces) {
        if (std::find(f.begin(), f.end(), x) == f.end()) without.push_back(f);
      }
      ASSERT_EQ(without.size() + 1, mesh.faces.size());
      EXPECT_EQ(sorted_faces(links), sorted_faces(without));
      insert_ear(links, links.find_halfedge(a, b), x);
      ASSERT_EQ(complaint(links), "");
      EXPECT_EQ(sorted_faces(links), sorted_faces(mesh.faces));
    }
  }
  EXPECT_GT(ears, 8);
}

// The vertices that went from one stage to the next are those of one pass, or of a decimating and an ear pass.
std::size_t match_passes(const HalfEdgeMesh& before, const HalfEdgeMesh& after, std::span<const PassRecord> passes) {
  std::set<std::uint32_t> gone;
  for (std::uint32_t v = 0; v < before.vertex_count(); ++v) {
    if (before.outgoing(v) != kNone && after.outgoing(v) == kNone) gone.insert(v);
  }
  std::set<std::uint32_t> removed;
  std::size_t used = 0;
  while (used < passes.size() && removed.size() < gone.size()) {
    const PassRecord& pass = passes[used++];
    std::size_t symbols = 0;
    for (Symbol symbol : pass.symbols) symbols += symbol != kNull ? 1u : 0u;
    EXPECT_EQ(pass.kind == PassKind::ears ? pass.ear_base.size() : symbols, pass.removed.size());
    const std::set<std::uint32_t> of_pass(pass.removed.begin(), pass.removed.end());
    for (std::uint32_t v : of_pass) {
      EXPECT_TRUE(removed.insert(v).second) << v << " was removed twice";
      if (pass.kind == PassKind::ears) {
        EXPECT_TRUE(before.is_boundary(v));
        continue;
      }
      before.for_each_neighbour(v, [&](std::uint32_t w) { EXPECT_EQ(of_pass.count(w), 0u) << v << " and " << w; });
      if (pass.kind == PassKind::cleaning) {
        EXPECT_EQ(before.face_valence(v), 3u);
      }
    }
  }
  EXPECT_EQ(removed, gone);
  EXPECT_LE(used, 2u);
  return used;
}

TEST(Decimation, EveryPassKeepsTheMeshWholeAndTakesAnIndependentSet) {
  for (const bool cleaning : {false, true}) {
    for (const auto& [name, mesh] : zoo()) {
      SCOPED_TRACE(name + (cleaning ? ", cleaning" : ""));
      Result<HalfEdgeMesh> links = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
      const Result<Lattice> lattice = Lattice::over(mesh, 12);
      ASSERT_TRUE(links.ok() && lattice.ok());
      std::vector<LatticePoint> points;
      for (const Position& p : mesh.positions) points.push_back(lattice->snap(p));
      const std::vector<Seed> seeds = choose_seeds(*links);
      std::vector<HalfEdgeMesh> stages = {*links};
      auto watch = [&](std::uint32_t left) {
        std::uint32_t in_faces = 0;
        for (std::uint32_t v = 0; v < links->vertex_count(); ++v) in_faces += links->outgoing(v) != kNone ? 1 : 0;
        EXPECT_EQ(left, in_faces);
        EXPECT_EQ(complaint(*links), "");
        stages.push_back(*links);
        return true;
      };
      bool cancelled = true;
      const std::vector<PassRecord> passes =
          decimate(*links, points, seeds, {{-0.3, std::nullopt}, cleaning}, watch, cancelled);
      EXPECT_FALSE(cancelled);
      std::size_t used = 0;
      for (std::size_t stage = 0; stage + 1 < stages.size(); ++stage) {
        used += match_passes(stages[stage], stages[stage + 1], std::span(passes).subspan(used));
      }
      EXPECT_EQ(used, passes.size());
      for (const Seed& seed : seeds) EXPECT_NE(links->find_halfedge(seed.s, seed.t), kNone);
      bool cleaned = false;
      for (const PassRecord& pass : passes) cleaned = cleaned || pass.kind == PassKind::cleaning;
      if (!cleaning) {
        EXPECT_FALSE(cleaned);
      }
    }
  }
}

TEST(Decimation, StopsWhenProgressSaysNo) {
  const TriangleMesh mesh = sphere(3);
  Result<HalfEdgeMesh> links = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  ASSERT_TRUE(links.ok());
  const std::vector<LatticePoint> points(mesh.positions.size(), {0, 0, 0});
  bool cancelled = false;
  const std::vector<Seed> seeds = choose_seeds(*links);
  EXPECT_TRUE(decimate(
                  *links, points, seeds, {}, [](std::uint32_t) { return false; }, cancelled)
                  .empty());
  EXPECT_TRUE(cancelled);
}

// Before every gate of a mesh of which nothing is decided: null first, each symbol once, everything within its range.
void expect_sound_hypotheses(const TriangleMesh& mesh, const std::vector<LatticePoint>& points) {
  const auto links = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  ASSERT_TRUE(links.ok());
  Marks marks;
  marks.clear(*links);
  Surroundings surroundings(*links, points, PassKind::decimating, 0, links->vertex_count());
  for (std::uint32_t i = 0; i < 3 * links->face_count(); ++i) {
    const std::uint32_t gate = HalfEdgeMesh::halfedge(i / 3, i % 3);
    const FaceView& face = surroundings.look_at_face(*links, marks, gate);
    for (const std::uint16_t corner : face.corner) ASSERT_LE(corner, kNoCorner);
    for (float input : face.input.value) ASSERT_LE(std::abs(input), 4);
    const std::span<const Hypothesis> all = surroundings.look(*links, marks, gate, kP, gate % 2 == 0 ? kM : kP);
    ASSERT_FALSE(all.empty());
    EXPECT_EQ(all[0].symbol, kNull);
    std::set<Symbol> symbols;
    for (const Hypothesis& h : all) {
      EXPECT_TRUE(symbols.insert(h.symbol).second);
      ASSERT_LT(h.row, kSymbolRows);
      for (const std::uint8_t state : h.state) ASSERT_LE(state, kNoVertex);
      for (float input : h.input.value) ASSERT_LE(std::abs(input), 4);  // not so for a NaN
    }
  }
}

TEST(HypothesesTest, StayWithinTheirRangesOnAnyGeometry) {
  Random random(12);
  for (const TriangleMesh& mesh : {torus(9, 12), holed_plate(2, 8), bipyramid(12000), cone(12000), tetrahedron()}) {
    std::vector<LatticePoint> points(mesh.positions.size(), {7, 7, 7});
    expect_sound_hypotheses(mesh, points);  // nothing has an area or a length
    for (LatticePoint& p : points) {
      for (std::int32_t& coordinate : p) coordinate = static_cast<std::int32_t>(random.below(1u << 24));
    }
    expect_sound_hypotheses(mesh, points);
  }
}

TEST(HypothesesTest, VerticesOfVeryManyFacesAreCoded) {
  EncodeOptions options;
  options.bits = 12;
  for (const TriangleMesh& mesh : {bipyramid(25000), cone(25000)}) EXPECT_EQ(round_trip(mesh, options), "");
}

}  // namespace
}  // namespace pmcd::codec::testing
