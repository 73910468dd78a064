// SPDX-License-Identifier: MIT
// Building the half-edge mesh: what is refused, by which name and at which place; what the links answer where it
// stands.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "codec/conquest/patch.h"
#include "codec/conquest/triangulation.h"
#include "codec/mesh/edge_table.h"
#include "codec/mesh/halfedge_mesh.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

void expect_refused(const std::vector<Face>& faces, std::size_t vertices, ErrorCode code, std::uint64_t where) {
  const Result<HalfEdgeMesh> mesh = HalfEdgeMesh::build(faces, vertices);
  ASSERT_FALSE(mesh.ok());
  EXPECT_STREQ(error_name(mesh.error().code), error_name(code)) << mesh.error().detail;
  EXPECT_EQ(mesh.error().where, where) << mesh.error().detail;
  EXPECT_FALSE(mesh.error().detail.empty());
}

HalfEdgeMesh built(const TriangleMesh& mesh) {
  Result<HalfEdgeMesh> result = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
  EXPECT_TRUE(result.ok());
  return result ? std::move(result).value() : HalfEdgeMesh();
}

TEST(HalfEdgeBuild, RefusesByNameAndPlace) {
  expect_refused({{0, 1, 2}, {1, 3, 4}}, 4, ErrorCode::index_out_of_range, 1);
  expect_refused({{0, 1, 0xFFFFFFFFu}}, 4, ErrorCode::index_out_of_range, 0);
  expect_refused({{0, 1, 2}, {2, 1, 3}, {3, 3, 4}}, 5, ErrorCode::repeated_index_in_face, 2);
  expect_refused({{0, 1, 0}}, 2, ErrorCode::repeated_index_in_face, 0);
  expect_refused({{0, 1, 1}}, 2, ErrorCode::repeated_index_in_face, 0);
  expect_refused({{0, 1, 2}, {2, 1, 3}, {0, 1, 2}}, 4, ErrorCode::duplicate_face, 2);
  expect_refused({{0, 1, 2}, {0, 2, 1}}, 3, ErrorCode::duplicate_face, 1);
  expect_refused({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, 5, ErrorCode::non_manifold_edge, 2);
  expect_refused({{0, 1, 2}, {0, 1, 3}}, 4, ErrorCode::opposing_faces, 1);
  expect_refused({{0, 1, 2}, {0, 3, 4}}, 5, ErrorCode::non_manifold_vertex, 0);
}

TEST(HalfEdgeBuild, TwoClosedFansAtAVertexAreRefused) {
  TriangleMesh mesh = tetrahedron();
  for (const Face& f : tetrahedron().faces)
    mesh.faces.push_back({f[0] == 0 ? 0 : f[0] + 3, f[1] == 0 ? 0 : f[1] + 3, f[2] == 0 ? 0 : f[2] + 3});
  expect_refused(mesh.faces, 7, ErrorCode::non_manifold_vertex, 0);
}

TEST(HalfEdgeBuild, MoebiusStripIsRefused) {
  // Five triangles around: orientation cannot agree everywhere.
  expect_refused({{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 0}, {4, 0, 1}}, 5, ErrorCode::opposing_faces, 4);
}

TEST(HalfEdgeBuild, AcceptsTheZooWithAllItsPromises) {
  for (const auto& [name, mesh] : zoo()) {
    const Result<HalfEdgeMesh> result = HalfEdgeMesh::build(mesh.faces, mesh.positions.size());
    ASSERT_TRUE(result.ok()) << name << ": " << text(result.error());
    EXPECT_EQ(complaint(*result), "") << name;
    EXPECT_EQ(result->vertex_count(), mesh.positions.size());
    EXPECT_EQ(result->face_count(), mesh.faces.size());
    EXPECT_EQ(sorted_faces(*result), sorted_faces(mesh.faces)) << name;
  }
}

TEST(HalfEdgeBuild, OneDamagedFaceAlwaysShows) {
  const TriangleMesh mesh = sphere(2);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    std::vector<Face> turned = mesh.faces;
    std::swap(turned[f][0], turned[f][1]);
    const Result<HalfEdgeMesh> refused = HalfEdgeMesh::build(turned, mesh.positions.size());
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::opposing_faces);
    std::vector<Face> without = mesh.faces;
    without.erase(without.begin() + static_cast<std::ptrdiff_t>(f));
    EXPECT_TRUE(HalfEdgeMesh::build(without, mesh.positions.size()).ok());
  }
}

TEST(HalfEdgeMeshTest, EdgesAndNeighboursAreThoseOfTheFaces) {
  for (const TriangleMesh& mesh :
       {grid(5, 4, 1), octahedron(), facing_threes(), single_triangle(), cone(7), holed_plate(1, 1)}) {
    const HalfEdgeMesh links = built(mesh);
    std::vector<std::set<std::uint32_t>> neighbours(mesh.positions.size());
    std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
    for (const Face& f : mesh.faces) {
      for (std::size_t c = 0; c < 3; ++c) {
        neighbours[f[c]].insert({f[(c + 1) % 3], f[(c + 2) % 3]});
        directed.insert({f[c], f[(c + 1) % 3]});
      }
    }
    for (std::uint32_t a = 0; a < links.vertex_count(); ++a) {
      std::vector<std::uint32_t> met;
      links.for_each_neighbour(a, [&](std::uint32_t v) { met.push_back(v); });
      EXPECT_EQ(std::set<std::uint32_t>(met.begin(), met.end()), neighbours[a]);
      EXPECT_EQ(met.size(), neighbours[a].size()) << "a neighbour was met twice";
      for (std::uint32_t b = 0; b < links.vertex_count(); ++b) {
        if (a == b) continue;
        EXPECT_EQ(links.has_edge(a, b), neighbours[a].count(b) == 1) << a << " " << b;
        const std::uint32_t h = links.find_halfedge(a, b);
        EXPECT_EQ(h != kNone, directed.count({a, b}) == 1) << a << " " << b;
        if (h != kNone) {
          EXPECT_EQ(links.origin(h), a);
          EXPECT_EQ(links.target(h), b);
        }
      }
    }
  }
}

TEST(HalfEdgeMeshTest, NeighboursComeCounterClockwise) {
  const HalfEdgeMesh links = built(bipyramid(6));
  for (std::uint32_t v = 0; v < links.vertex_count(); ++v) {
    std::vector<std::uint32_t> met;
    links.for_each_neighbour(v, [&](std::uint32_t w) { met.push_back(w); });
    for (std::size_t i = 0; i < met.size(); ++i) {
      // v, this neighbour, the next one are a face in this orientation.
      const std::uint32_t h = links.find_halfedge(v, met[i]);
      ASSERT_NE(h, kNone);
      EXPECT_EQ(links.apex(h), met[(i + 1) % met.size()]);
    }
  }
}

TEST(HalfEdgeMeshTest, BoundaryIsWhereAnOppositeIsMissing) {
  const HalfEdgeMesh open = built(grid(4, 3, 0));
  unsigned boundary = 0;
  for (std::uint32_t v = 0; v < open.vertex_count(); ++v) boundary += open.is_boundary(v) ? 1 : 0;
  EXPECT_EQ(boundary, 14u);
  const HalfEdgeMesh closed = built(torus(5, 5));
  for (std::uint32_t v = 0; v < closed.vertex_count(); ++v) EXPECT_FALSE(closed.is_boundary(v));
}

TEST(EdgeTableTest, GroupsEveryHalfEdgeOnceByItsEdge) {
  const TriangleMesh mesh = grid(9, 7, 4);
  const EdgeTable edges(mesh.faces, mesh.positions.size());
  std::set<std::uint32_t> met;
  for (std::size_t e = 0; e < edges.edge_count(); ++e) {
    std::set<std::set<std::uint32_t>> ends;
    for (std::uint32_t h : edges.halfedges(e)) {
      EXPECT_TRUE(met.insert(h).second);
      ends.insert({mesh.faces[h / 3][h % 3], mesh.faces[h / 3][(h + 1) % 3]});
    }
    EXPECT_EQ(ends.size(), 1u);
    EXPECT_TRUE(std::is_sorted(edges.halfedges(e).begin(), edges.halfedges(e).end()));
  }
  EXPECT_EQ(met.size(), 3 * mesh.faces.size());
  // Euler: V - E + F = 2 - (loops) for a genus 0 mesh with boundary: rim and four holes.
  EXPECT_EQ(static_cast<std::ptrdiff_t>(mesh.positions.size() + mesh.faces.size()) -
                static_cast<std::ptrdiff_t>(edges.edge_count()),
            2 - 5);
}

TEST(EdgeTableTest, EmptyMeshHasNoEdges) {
  EXPECT_EQ(EdgeTable({}, 3).edge_count(), 0u);
}

TEST(HalfEdgeReorder, GivesFacesOtherNumbersOnly) {
  Random random(12);
  for (const TriangleMesh& mesh : {sphere(2), grid(7, 6, 2), torus(5, 6), single_triangle()}) {
    const HalfEdgeMesh before = built(mesh);
    std::vector<std::uint32_t> order(before.face_count());
    for (std::uint32_t f = 0; f < order.size(); ++f) order[f] = f;
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
    HalfEdgeMesh after = before;
    after.reorder(order);
    ASSERT_EQ(complaint(after), "");
    for (std::uint32_t f = 0; f < order.size(); ++f) EXPECT_EQ(after.face(f), before.face(order[f]));
    for (std::uint32_t v = 0; v < before.vertex_count(); ++v) {
      EXPECT_EQ(HalfEdgeMesh::halfedge(order[HalfEdgeMesh::face_of(after.outgoing(v))],
                                       HalfEdgeMesh::edge_of(after.outgoing(v))),
                before.outgoing(v));
    }
  }
}

TEST(HalfEdgeReorder, LeavesFreeSlotsOut) {
  HalfEdgeMesh mesh = built(sphere(2));
  const std::uint32_t faces = mesh.face_count();
  Patch patch;
  ASSERT_TRUE(collect_star(mesh, 8, patch));
  const std::uint32_t centre = patch.centre;
  remove_centre(mesh, patch, interior_triangulation(patch.size, Tag::plus, Tag::minus));
  std::vector<std::uint32_t> order;
  for (std::uint32_t f = faces; f-- > 0;) {
    if (!mesh.is_free_slot(f)) order.push_back(f);
  }
  ASSERT_EQ(order.size(), faces - 2);
  const HalfEdgeMesh before = mesh;
  mesh.reorder(order);
  EXPECT_EQ(mesh.face_count(), faces - 2);
  EXPECT_EQ(complaint(mesh), "");
  for (std::uint32_t f = 0; f < order.size(); ++f) EXPECT_EQ(mesh.face(f), before.face(order[f]));
  EXPECT_EQ(mesh.outgoing(centre), kNone);
}

}  // namespace
}  // namespace pmcd::codec::testing
