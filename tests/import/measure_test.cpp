// SPDX-License-Identifier: GPL-3.0-or-later
// Distances on shapes whose answer is known, and CGAL's verdict on meshes.
#include "codec/import/measure.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/import/support.h"

namespace pmcd::import::testing {
namespace {

TriangleMesh square(double z, double side = 1) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, z}, {side, 0, z}, {side, side, z}, {0, side, z}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(ErrorMeter, ToItselfIsExactlyZero) {
  const TriangleMesh mesh = torus(50, 30);
  const Distance d = ErrorMeter(mesh).distance_to(renumbered(mesh, 1));
  EXPECT_EQ(d.rms, 0);
  EXPECT_EQ(d.max, 0);
}

TEST(ErrorMeter, IsRelativeToTheDiagonalOfTheOriginal) {
  const ErrorMeter meter(square(0, 2));
  EXPECT_DOUBLE_EQ(meter.diagonal(), std::sqrt(8.0));
  const Distance d = meter.distance_to(square(0.5, 2));
  EXPECT_DOUBLE_EQ(d.rms, 0.5 / std::sqrt(8.0));
  EXPECT_DOUBLE_EQ(d.max, 0.5 / std::sqrt(8.0));
}

TEST(ErrorMeter, TellsRmsFromMaximum) {
  // One corner of four lies 3 above the plane of the other.
  TriangleMesh bent = square(0, 10);
  bent.positions[3][2] = 3;
  const ErrorMeter meter(bent);
  const Distance d = meter.distance_to(square(0, 10));
  EXPECT_DOUBLE_EQ(d.max * meter.diagonal(), 3);
  EXPECT_DOUBLE_EQ(d.rms * meter.diagonal(), 1.5);
}

TEST(ErrorMeter, MeasuresToFacesEdgesAndCorners) {
  TriangleMesh probe;
  probe.positions = {{0.25, 0.25, 2}, {0.5, -3, 0}, {-3, -4, 0}};
  const ErrorMeter meter(probe);
  const double unit = meter.diagonal();
  TriangleMesh single = square(0);
  single.faces.resize(1);
  for (std::size_t v = 0; v < 3; ++v) {
    TriangleMesh one;
    one.positions = {probe.positions[v]};
    const double expected[] = {2, 3, 5};
    EXPECT_DOUBLE_EQ(ErrorMeter(one).distance_to(single).max, expected[v]);
  }
  EXPECT_DOUBLE_EQ(meter.distance_to(single).max * unit, 5);
}

TEST(ErrorMeter, FacesWithoutAreaCountAsWhatTheyAre) {
  TriangleMesh probe;
  probe.positions = {{0.5, 1, 0}};
  TriangleMesh flat;
  flat.positions = {{-1, 0, 0}, {0.25, 0, 0}, {1, 0, 0}};
  flat.faces = {{0, 1, 2}};
  EXPECT_DOUBLE_EQ(ErrorMeter(probe).distance_to(flat).max, 1);
  TriangleMesh point;
  point.positions = {{0.5, 3, 0}, {0.5, 3, 0}, {0.5, 3, 0}};
  point.faces = {{0, 1, 2}};
  EXPECT_DOUBLE_EQ(ErrorMeter(probe).distance_to(point).max, 2);
}

TEST(ErrorMeter, IsolatedVerticesAreSurfaceToo) {
  TriangleMesh probe;
  probe.positions = {{10, 0, 1}};
  TriangleMesh target = square(0);
  target.positions.push_back({10, 0, 0});
  EXPECT_DOUBLE_EQ(ErrorMeter(probe).distance_to(target).max, 1);
  TriangleMesh cloud;
  cloud.positions = {{10, 0, 3}, {10, 0, 5}};
  EXPECT_DOUBLE_EQ(ErrorMeter(probe).distance_to(cloud).max, 2);
}

TEST(ErrorMeter, EmptyMeshes) {
  EXPECT_EQ(ErrorMeter({}).distance_to(square(0)).max, 0);
  EXPECT_EQ(ErrorMeter(square(0)).distance_to({}).max, std::numeric_limits<double>::infinity());
}

TEST(ErrorMeter, SamplesWithAFixedStride) {
  EXPECT_EQ(ErrorMeter(torus(100, 200)).samples(), 20000u);
  EXPECT_EQ(ErrorMeter(torus(101, 200)).samples(), 10100u);
  EXPECT_EQ(ErrorMeter(torus(10, 20)).samples(), 200u);
}

TEST(IsValidCgal, TellsManifoldFromOther) {
  EXPECT_TRUE(is_valid_cgal(torus(6, 5)));
  EXPECT_TRUE(is_valid_cgal(square(0)));
  TriangleMesh turned = torus(6, 5);
  std::swap(turned.faces[4][0], turned.faces[4][1]);
  EXPECT_FALSE(is_valid_cgal(turned));
  TriangleMesh bow_tie;
  bow_tie.positions.resize(5);
  bow_tie.faces = {{0, 1, 2}, {2, 3, 4}};
  EXPECT_FALSE(is_valid_cgal(bow_tie));
}

}  // namespace
}  // namespace pmcd::import::testing
