// SPDX-License-Identifier: GPL-3.0-or-later
// Polygons to triangles: shape, diagonals that are taken already, polygons that no ear can be clipped from.
#include "codec/import/triangulate.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

double signed_area_xy(const std::vector<Position>& p, const Face& f) {
  return ((p[f[1]][0] - p[f[0]][0]) * (p[f[2]][1] - p[f[0]][1]) -
          (p[f[1]][1] - p[f[0]][1]) * (p[f[2]][0] - p[f[0]][0])) /
         2;
}

std::set<std::set<std::uint32_t>> as_sets(const std::vector<Face>& faces) {
  std::set<std::set<std::uint32_t>> out;
  for (const Face& f : faces) out.insert({f.begin(), f.end()});
  return out;
}

std::vector<std::uint32_t> iota(std::uint32_t n) {
  std::vector<std::uint32_t> out(n);
  std::iota(out.begin(), out.end(), 0u);
  return out;
}

TEST(Triangulate, TrianglesStayAsTheyAre) {
  const std::vector<std::uint32_t> corners{0, 1, 2, 2, 1, 3};
  const std::vector<std::uint32_t> ends{3, 6};
  const Triangulation t = triangulate(tetrahedron().positions, corners, ends);
  EXPECT_EQ(t.faces, (std::vector<Face>{{0, 1, 2}, {2, 1, 3}}));
  EXPECT_TRUE(t.polygon.empty());
  EXPECT_EQ(t.polygons, 0u);
}

TEST(Triangulate, QuadTakesItsShorterDiagonal) {
  const std::vector<Position> kite{{-5, 0, 0}, {0, -1, 0}, {5, 0, 0}, {0, 1, 0}};
  const Triangulation t = triangulate(kite, iota(4), std::vector<std::uint32_t>{4});
  EXPECT_EQ(as_sets(t.faces), (std::set<std::set<std::uint32_t>>{{0, 1, 3}, {1, 2, 3}}));
  for (const Face& f : t.faces) EXPECT_GT(signed_area_xy(kite, f), 0);
  EXPECT_EQ(t.polygon, (std::vector<std::uint32_t>{0, 0}));
}

TEST(Triangulate, ConcavePolygonsKeepTheirShape) {
  // An arrow head whose shorter diagonal runs outside, and a comb with many reflex corners; every start, both tilts.
  const std::vector<Position> arrow{{0, 0, 0}, {4, 3, 0}, {0, 6, 0}, {1, 3, 0}};
  std::vector<Position> comb;
  for (int tooth = 0; tooth < 6; ++tooth) {
    comb.push_back({2.0 * tooth, 0, 0});
    comb.push_back({2.0 * tooth + 1, 10, 0});
  }
  comb.push_back({12, 0, 0});
  comb.push_back({12, -1, 0});
  comb.push_back({0, -1, 0});
  std::reverse(comb.begin(), comb.end());  // counter-clockwise
  // The shortest diagonal by far cuts off a tip into which a notch reaches.
  const std::vector<Position> notch{{0, 0, 0}, {0.4, -5, 0}, {0.5, 5, 0}, {0.6, -5, 0}, {1, 0, 0}, {0.5, 10, 0}};
  for (const std::vector<Position>& shape : {arrow, comb, notch}) {
    double area = 0;
    for (std::size_t i = 0; i < shape.size(); ++i) {
      const Position& p = shape[i];
      const Position& q = shape[(i + 1) % shape.size()];
      area += (p[0] * q[1] - p[1] * q[0]) / 2;
    }
    ASSERT_GT(area, 0);
    for (std::uint32_t start = 0; start < shape.size(); ++start) {
      std::vector<std::uint32_t> corners = iota(static_cast<std::uint32_t>(shape.size()));
      std::rotate(corners.begin(), corners.begin() + start, corners.end());
      for (const bool tilted : {false, true}) {
        std::vector<Position> positions = shape;
        if (tilted) {
          for (Position& p : positions) p[2] = 3 * p[0] - 2 * p[1];
        }
        const Triangulation t =
            triangulate(positions, corners, std::vector<std::uint32_t>{static_cast<std::uint32_t>(corners.size())});
        ASSERT_EQ(t.faces.size(), shape.size() - 2);
        double sum = 0;
        for (const Face& f : t.faces) {
          EXPECT_GT(signed_area_xy(positions, f), 0);
          sum += signed_area_xy(positions, f);
        }
        EXPECT_NEAR(sum, area, 1e-9);
        EXPECT_EQ(t.not_simple, 0u);
      }
    }
  }
}

TEST(Triangulate, AvoidsADiagonalThatIsAnEdgeAlready) {
  // The quad would be cut along 1-3, which the triangle beside it has as an edge.
  const std::vector<Position> positions{{-5, 0, 0}, {0, -1, 0}, {5, 0, 0}, {0, 1, 0}, {0, 0, 5}};
  const std::vector<std::uint32_t> corners{0, 1, 2, 3, 1, 3, 4};
  const Triangulation t = triangulate(positions, corners, std::vector<std::uint32_t>{4, 7});
  EXPECT_EQ(as_sets(t.faces), (std::set<std::set<std::uint32_t>>{{0, 1, 2}, {0, 2, 3}, {1, 3, 4}}));
  EXPECT_EQ(t.diagonals_avoided, 1u);
  EXPECT_EQ(t.polygon, (std::vector<std::uint32_t>{0, 0, 1}));
}

TEST(Triangulate, TwoPolygonsWithTheSameCornersDoNotShareADiagonal) {
  // A pillow: the same quad from both sides is a closed surface if the diagonals differ, else not manifold.
  const auto mesh = read_text("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n4 3 2 1 0\n", "off");
  ASSERT_TRUE(mesh.ok()) << to_line(mesh.error());
  EXPECT_EQ(mesh->mesh.faces.size(), 4u);
}

TEST(Triangulate, PolygonsWithoutAnEarAreCutAllTheSame) {
  const std::vector<Position> line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  const Triangulation flat = triangulate(line, iota(5), std::vector<std::uint32_t>{5});
  EXPECT_EQ(flat.faces.size(), 3u);
  EXPECT_EQ(flat.not_simple, 1u);
  // Areas that overflow to infinity.
  const std::vector<Position> far{{1e308, 0, 0}, {-1e308, 1e308, 0}, {1e308, -1e308, 0}, {0, 1e308, 1e308}};
  EXPECT_EQ(triangulate(far, iota(4), std::vector<std::uint32_t>{4}).faces.size(), 2u);
}

TEST(Triangulate, LargePolygonsTakeLinearTime) {
  constexpr std::uint32_t kCorners = 1'000'000;
  std::vector<Position> ring;
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    ring.push_back({std::cos(6.283185307 * i / kCorners), std::sin(6.283185307 * i / kCorners), 0});
  }
  const Triangulation t = triangulate(ring, iota(kCorners), std::vector<std::uint32_t>{kCorners});
  EXPECT_EQ(t.faces.size(), kCorners - 2u);
}

TEST(Triangulate, RandomPolygonMeshesStayManifold) {
  // Merging pairs of a torus' triangles back into quads must never cost manifoldness, however they are cut again.
  const TriangleMesh mesh = torus(3, 3);
  for (unsigned pattern = 0; pattern < 512; ++pattern) {
    std::vector<std::uint32_t> corners;
    std::vector<std::uint32_t> ends;
    for (std::size_t quad = 0; quad < 9; ++quad) {
      const Face& f = mesh.faces[2 * quad];
      const Face& g = mesh.faces[2 * quad + 1];
      if ((pattern >> quad & 1) != 0) {
        corners.insert(corners.end(), {f[0], f[1], f[2], g[2]});
        ends.push_back(static_cast<std::uint32_t>(corners.size()));
      } else {
        for (const Face& t : {f, g}) {
          corners.insert(corners.end(), t.begin(), t.end());
          ends.push_back(static_cast<std::uint32_t>(corners.size()));
        }
      }
    }
    const Triangulation t = triangulate(mesh.positions, corners, ends);
    ASSERT_EQ(t.faces.size(), 18u);
    std::multiset<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Face& f : t.faces) {
      for (std::size_t c = 0; c < 3; ++c) edges.insert({f[c], f[(c + 1) % 3]});
    }
    for (const auto& edge : edges) ASSERT_EQ(edges.count(edge), 1u) << pattern;
  }
}

}  // namespace
}  // namespace pmcd::import::testing
