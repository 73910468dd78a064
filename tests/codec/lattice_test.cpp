// SPDX-License-Identifier: MIT
// The lattice and what lifts its points to exact floats: snapping, limits, the order of floats, the runs of floats that
// share an index.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

#include "codec/lattice/lattice.h"
#include "codec/lattice/ordered_float.h"
#include "tests/codec/clouds.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

constexpr float kFloatDenormal = std::numeric_limits<float>::denorm_min();

TEST(LatticeTest, StepIsTheLargestExtentByTheNumberOfSteps) {
  const Lattice lattice = over(cloud({{-1, 2, 3}, {4, 2.5, 3}}), 8);
  EXPECT_EQ(lattice.bits, 8u);
  EXPECT_EQ(lattice.max_index(), 255);
  EXPECT_EQ(lattice.min, (Position{-1, 2, 3}));
  EXPECT_EQ(lattice.step, 5.0 / 255);
  EXPECT_TRUE(lattice.valid());
  EXPECT_EQ(lattice.snap(Position{-1, 2, 3}), (LatticePoint{0, 0, 0}));
  EXPECT_EQ(lattice.snap(Position{4, 2.5, 3}), (LatticePoint{255, 26, 0}));  // 0.5 / step = 25.5: rounded up
  EXPECT_EQ(lattice.position({255, 0, 0})[0], static_cast<double>(static_cast<float>(-1 + 255 * (5.0 / 255))));
}

TEST(LatticeTest, SnappingIsNearestAndClamped) {
  const Lattice lattice = over(cloud({{0, 0, 0}, {15, 15, 15}}), 4);
  ASSERT_EQ(lattice.step, 1.0);
  EXPECT_EQ(lattice.snap(3.49, 0), 3);
  EXPECT_EQ(lattice.snap(3.5, 0), 4);
  EXPECT_EQ(lattice.snap(-7.0, 1), 0);
  EXPECT_EQ(lattice.snap(15.49, 2), 15);
  EXPECT_EQ(lattice.snap(1e300, 2), 15);
}

TEST(LatticeTest, EveryPointSnapsWithinHalfAStepAndStays) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const TriangleMesh mesh = any_mesh(seed);
    const unsigned bits = 4 + static_cast<unsigned>(seed % 21);
    const Lattice lattice = over(mesh, bits);
    EXPECT_TRUE(lattice.valid());
    for (const Position& p : mesh.positions) {
      const LatticePoint point = lattice.snap(p);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        ASSERT_GE(point[axis], 0);
        ASSERT_LE(point[axis], lattice.max_index());
        const double exact = lattice.min[axis] + point[axis] * lattice.step;
        ASSERT_LE(std::abs(exact - p[axis]), lattice.step * 0.5000001 + std::abs(p[axis]) * 1e-15) << "seed " << seed;
      }
    }
    EXPECT_EQ(difference(snapped(mesh, bits),
                         [&] {
                           TriangleMesh other = mesh;
                           for (Position& p : other.positions) p = lattice.position(lattice.snap(p));
                           return other;
                         }()),
              "")
        << "seed " << seed;
  }
}

// Every axis: a compiler that vectorises the loop over them once forgot to round two of the three.
TEST(LatticeTest, PositionsAreRoundedToFloat32) {
  Lattice lattice;
  lattice.min = {0.1f, 0.2f, 0.3f};
  lattice.step = 0.000123456789;
  const Position p = lattice.position({1000, 2000, 3000});
  EXPECT_EQ(p[0], 0.22345678508281708);
  EXPECT_EQ(p[1], 0.44691357016563416);
  EXPECT_EQ(p[2], 0.67037039995193481);
}

TEST(LatticeTest, OnePointHasNoExtent) {
  const Lattice lattice = over(cloud({{1, -2, 3}, {1, -2, 3}}), 12);
  EXPECT_EQ(lattice.step, 0.0);
  EXPECT_TRUE(lattice.valid());
  EXPECT_EQ(lattice.snap(Position{1, -2, 3}), (LatticePoint{0, 0, 0}));
  EXPECT_EQ(lattice.position({0, 0, 0}), (Position{1, -2, 3}));
}

TEST(LatticeTest, DenormalExtentKeepsAStep) {
  const Lattice f = over(cloud({{0, 0, 0}, {kFloatDenormal, 0, 0}}), 24);
  EXPECT_GT(f.step, 0);
  EXPECT_TRUE(f.valid());
  EXPECT_EQ(f.position(f.snap(Position{kFloatDenormal, 0, 0}))[0], kFloatDenormal);
  const double tiny = std::numeric_limits<double>::denorm_min();
  const Lattice d = over(cloud({{0, 0, 0}, {tiny, 0, 0}}, Scalar::float64), 24);
  EXPECT_EQ(d.step, tiny);
  EXPECT_EQ(d.position(d.snap(Position{tiny, 0, 0}))[0], tiny);
}

TEST(LatticeTest, RefusesWhatItCannotHold) {
  auto refused = [](const TriangleMesh& mesh) {
    const Result<Lattice> lattice = Lattice::over(mesh, 12);
    EXPECT_FALSE(lattice.ok());
    return lattice.ok() ? std::pair{ErrorCode::internal_error, std::uint64_t{0}}
                        : std::pair{lattice.error().code, lattice.error().where};
  };
  const double inf = std::numeric_limits<double>::infinity();
  using Refusal = std::pair<ErrorCode, std::uint64_t>;
  EXPECT_EQ(refused(cloud({{0, 0, 0}, {0, inf, 0}})), (Refusal{ErrorCode::non_finite_coordinate, 1}));
  EXPECT_EQ(refused(cloud({{0, 0, -inf}})), (Refusal{ErrorCode::non_finite_coordinate, 0}));
  EXPECT_EQ(refused(cloud({{0, 0, 0}, {0, 0, 0}, {std::nan(""), 0, 0}})),
            (Refusal{ErrorCode::non_finite_coordinate, 2}));
  EXPECT_EQ(refused(cloud({{0, 0.1, 0}})), (Refusal{ErrorCode::not_representable, 0}));
  EXPECT_EQ(refused(cloud({{0, 0, 0}, {0, 0, 1e39}})), (Refusal{ErrorCode::not_representable, 1}));
  EXPECT_EQ(refused(cloud({{0, 0, 1.7e308}}, Scalar::float64)), (Refusal{ErrorCode::extent_too_large, 2}));
  EXPECT_TRUE(Lattice::over(cloud({{0, 0.1, 0}}, Scalar::float64), 12).ok());
  EXPECT_TRUE(Lattice::over(cloud({{3.4028234663852886e38, 0, 0}, {-3.4028234663852886e38, 0, 0}}), 24).ok());
}

TEST(LatticeTest, ValidRefusesClaimsThatMakeNoSense) {
  const Lattice good = over(cloud({{0, 0, 0}, {1, 2, 3}}), 12);
  auto with = [&](auto change) {
    Lattice lattice = good;
    change(lattice);
    return lattice.valid();
  };
  EXPECT_TRUE(with([](Lattice&) {}));
  EXPECT_FALSE(with([](Lattice& l) { l.bits = 3; }));
  EXPECT_FALSE(with([](Lattice& l) { l.bits = 25; }));
  EXPECT_FALSE(with([](Lattice& l) { l.bits = 255; }));
  EXPECT_FALSE(with([](Lattice& l) { l.step = -1e-9; }));
  EXPECT_FALSE(with([](Lattice& l) { l.step = std::nan(""); }));
  EXPECT_FALSE(with([](Lattice& l) { l.step = std::numeric_limits<double>::infinity(); }));
  EXPECT_FALSE(with([](Lattice& l) { l.step = 1e36; }));  // 4095 steps leave float32
  EXPECT_FALSE(with([](Lattice& l) { l.scalar = Scalar::float64, l.step = 1e305; }));
  EXPECT_TRUE(with([](Lattice& l) { l.scalar = Scalar::float64, l.step = 1e36; }));
  EXPECT_FALSE(with([](Lattice& l) { l.min[1] = std::nan(""); }));
  EXPECT_FALSE(with([](Lattice& l) { l.min[2] = -std::numeric_limits<double>::infinity(); }));
}

TEST(OrderedFloat, KeepsTheOrderAndComesBack) {
  const float inf = std::numeric_limits<float>::infinity();
  std::int64_t last = to_ordered(-std::numeric_limits<float>::max(), Scalar::float32);
  Random random(3);
  for (float x = -std::numeric_limits<float>::max(); x < std::numeric_limits<float>::max();) {
    const float next =
        random.one_in(3) ? std::nextafter(x, inf) : std::max(std::nextafter(x, inf), x < 0 ? x * 0.97f : x * 1.03f);
    if (next == inf) break;
    const std::int64_t ordered = to_ordered(next, Scalar::float32);
    if (next == std::nextafter(x, inf) && !(x == 0 || next == 0)) {
      ASSERT_EQ(ordered, last + 1);
    }
    ASSERT_GT(ordered, last);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(from_ordered(ordered, Scalar::float32)),
              std::bit_cast<std::uint64_t>(double{next}));
    last = ordered;
    x = next;
  }
}

TEST(OrderedFloat, NegativeZeroLiesJustBelowPositiveZero) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    EXPECT_EQ(to_ordered(0.0, scalar), 0);
    EXPECT_EQ(to_ordered(-0.0, scalar), -1);
    EXPECT_TRUE(std::signbit(from_ordered(-1, scalar)));
    EXPECT_FALSE(std::signbit(from_ordered(0, scalar)));
    EXPECT_EQ(from_ordered(0, scalar), 0.0);
  }
  EXPECT_EQ(to_ordered(kFloatDenormal, Scalar::float32), 1);
  EXPECT_EQ(to_ordered(-kFloatDenormal, Scalar::float32), -2);
  EXPECT_EQ(to_ordered(-std::numeric_limits<double>::denorm_min(), Scalar::float64), -2);
  EXPECT_EQ(to_ordered(1.0, Scalar::float64), std::bit_cast<std::int64_t>(1.0));
}

TEST(OrderedFloat, DoublesKeepTheirOrder) {
  Random random(12);
  for (int i = 0; i < 20000; ++i) {
    const double a = std::bit_cast<double>(random.bits());
    const double b = random.one_in(2) ? std::bit_cast<double>(random.bits()) : std::nextafter(a, 0.0);
    if (!std::isfinite(a) || !std::isfinite(b) || a == b) continue;
    const std::int64_t oa = to_ordered(a, Scalar::float64);
    EXPECT_EQ(a < b, oa < to_ordered(b, Scalar::float64));
    EXPECT_EQ(std::bit_cast<std::uint64_t>(from_ordered(oa, Scalar::float64)), std::bit_cast<std::uint64_t>(a));
  }
}

TEST(LatticeTest, MiddlesOfMultiplesLieBetweenThem) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    for (const Unit& unit : {Unit{1, -3}, Unit{5, -7}, Unit{2, 5}, Unit{0, -20}}) {
      Lattice lattice;
      lattice.scalar = scalar;
      lattice.bits = 12;
      lattice.set_unit(unit, {-2000, 12'345'678, std::int64_t{1} << 45});
      ASSERT_TRUE(lattice.valid());
      for (std::int32_t i = 0; i < lattice.max_index(); ++i) {
        const Position low = lattice.position({i, i, i});
        const Position high = lattice.position({i + 1, i + 1, i + 1});
        const Position even = lattice.position_of_middle({2 * i, 2 * i, 2 * i});
        const Position odd = lattice.position_of_middle({2 * i + 1, 2 * i + 1, 2 * i + 1});
        ASSERT_EQ(even, low);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          ASSERT_LE(low[axis], odd[axis]);
          ASSERT_LE(odd[axis], high[axis]);
        }
        if (scalar == Scalar::float32) continue;
        ASSERT_NEAR((odd[0] - low[0]) / lattice.step, 0.5, 1e-6);
      }
    }
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
