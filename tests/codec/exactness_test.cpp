// SPDX-License-Identifier: MIT
// What lifts lattice positions to exact coordinates: units, decimals, the cells of a lattice, and whole meshes of every
// kind of number, hostile sections among them.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>

#include "codec/encoder.h"
#include "codec/encoder/stepped_grid.h"
#include "codec/lattice/cell.h"
#include "codec/lattice/decimals.h"
#include "codec/lattice/unit.h"
#include "codec/packet/base_header.h"
#include "codec/packet/header.h"
#include "tests/codec/clouds.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"
#include "tests/sanitized.h"

namespace pmcd::codec::testing {
namespace {

constexpr double kDenormal = std::numeric_limits<float>::denorm_min();

TEST(Unit, ValuesAreTheNearestDoubles) {
  EXPECT_EQ(multiple_of({1, -1}, 3), 0.3);
  EXPECT_EQ(multiple_of({5, -5}, 20001), 1.00005);
  EXPECT_EQ(multiple_of({2, 3}, -7), -14000.0);
  EXPECT_EQ(multiple_of({0, -3}, 9), 1.125);
  EXPECT_EQ(multiple_of({0, 100}, -1), -std::ldexp(1.0, 100));
  EXPECT_EQ(multiple_of({1, -22}, 123456789), 123456789e-22);
  Random random(11);
  for (int i = 0; i < 20000; ++i) {
    const int exponent = static_cast<int>(random.below(45)) - 22;
    const auto k = static_cast<std::int64_t>(random.bits() >> (14 + random.below(49)));
    const std::string text = std::to_string(k) + "e" + std::to_string(exponent);
    ASSERT_EQ(multiple_of({1, static_cast<std::int16_t>(exponent)}, k), std::strtod(text.c_str(), nullptr)) << text;
  }
}

TEST(Unit, WholeNumbersNextToANumber) {
  EXPECT_EQ(whole_above(2.0), 2);
  EXPECT_EQ(whole_above(2.1), 3);
  EXPECT_EQ(whole_above(-2.1), -2);
  EXPECT_EQ(whole_below(2.9), 2);
  EXPECT_EQ(whole_below(-2.1), -3);
  EXPECT_EQ(whole_above(1e300), kMaxWhole);
  EXPECT_EQ(whole_above(-std::numeric_limits<double>::infinity()), -kMaxWhole);
  EXPECT_EQ(whole_below(1e300), kMaxWhole);
  EXPECT_EQ(whole_above(std::nan("")), 0);
}

TEST(Unit, RefusesWhatHasNoExactPower) {
  EXPECT_TRUE(valid(Unit{1, -22}));
  EXPECT_TRUE(valid(Unit{5, 22}));
  EXPECT_TRUE(valid(Unit{0, -1000}));
  EXPECT_FALSE(valid(Unit{1, 23}));
  EXPECT_FALSE(valid(Unit{1, -32768}));
  EXPECT_FALSE(valid(Unit{3, 0}));
  EXPECT_FALSE(valid(Unit{4, 0}));
  EXPECT_FALSE(valid(Unit{255, 0}));
  EXPECT_FALSE(valid(Unit{0, 1001}));
  EXPECT_FALSE(valid(Decimals{{1, 0}, 16}));
  EXPECT_FALSE(valid(Decimals{{2, 0}, 3}));
  EXPECT_FALSE(valid(Decimals{{0, 0}, 3}));
}

// Two digits, unit 0.01: 0, 0.01 ... 0.99, 1.0, 1.1 ... 9.9, 10 ... 99, 100, 110.
TEST(DecimalsTest, AreNumberedWithoutGaps) {
  const Decimals two{{1, -2}, 2};
  EXPECT_EQ(value_of(two, 0), 0.0);
  EXPECT_EQ(value_of(two, 99), 0.99);
  EXPECT_EQ(value_of(two, 100), 1.0);
  EXPECT_EQ(value_of(two, 101), 1.1);
  EXPECT_EQ(value_of(two, 189), 9.9);
  EXPECT_EQ(value_of(two, 190), 10.0);
  EXPECT_EQ(value_of(two, 279), 99.0);
  EXPECT_EQ(value_of(two, 280), 100.0);
  EXPECT_EQ(value_of(two, -281), -110.0);
  for (std::int64_t n = -1500; n <= 1500; ++n) {
    const double here = value_of(two, n);
    const double next = value_of(two, n + 1);
    ASSERT_LT(here, next) << n;
    const std::int64_t first = first_from(two, here);  // up to a rounding of here / 0.01
    ASSERT_TRUE(first == n || first == n + 1) << here;
    ASSERT_EQ(first_from(two, here + (next - here) * 0.25), n + 1) << here;
    ASSERT_EQ(first_from(two, here + (next - here) * 0.75), n + 1) << here;
  }
}

TEST(DecimalsTest, FirstFromNeverFalls) {
  Random random(5);
  for (int i = 0; i < 300; ++i) {
    Decimals decimals{{1, static_cast<std::int16_t>(static_cast<int>(random.below(45)) - 22)}, random.below(16)};
    if (random.one_in(3))
      decimals = {{random.one_in(2) ? std::uint8_t{5} : std::uint8_t{0}, decimals.unit.exponent}, 0};
    ASSERT_TRUE(valid(decimals));
    double value = -std::numeric_limits<double>::max();
    std::int64_t last = first_from(decimals, value);
    while (value < std::numeric_limits<double>::max() / 4) {
      const double step = std::abs(value) * random.unit() * (random.one_in(2) ? 1e-3 : 0.7);
      value = std::abs(value) < 1e-300 ? 1e-300 : value + std::max(step, 1e-301);
      const std::int64_t number = first_from(decimals, value);
      ASSERT_GE(number, last) << value;
      last = number;
    }
    EXPECT_LE(last, std::int64_t{1} << 56);
  }
}

// All cells' numbers follow each other without gap or overlap, and each snaps to its cell.
void expect_partition(const Lattice& lattice, const Decimals* decimals, bool check_each) {
  Cell last = cell_of(lattice, 0, 0, decimals);
  for (std::int32_t index = 1; index <= lattice.max_index(); ++index) {
    const Cell cell = cell_of(lattice, index, 0, decimals);
    ASSERT_EQ(static_cast<std::uint64_t>(cell.first), static_cast<std::uint64_t>(last.first) + last.count) << index;
    for (std::uint64_t n = 0; check_each && n < cell.count; ++n) {
      ASSERT_EQ(lattice.snap(cell.value(n), 0), index);
      ASSERT_EQ(cell.nearest(cell.value(n)), n);
    }
    last = cell;
  }
}

TEST(CellTest, CoversEveryFloatOnce) {
  expect_partition(over(cloud({{1000, 0, 0}, {1000.25f, 0, 0}}), 8), nullptr, true);
  expect_partition(over(cloud({{-300 * kDenormal, 0, 0}, {500 * kDenormal, 0, 0}}), 6), nullptr, true);
  expect_partition(over(cloud({{1, 0, 0}, {std::nextafter(1.0f, 2.0f), 0, 0}}), 4), nullptr, true);
}

TEST(CellTest, CoversEveryDecimalOnce) {
  const Decimals three{{1, -5}, 3};
  expect_partition(over(cloud({{-2.5, 0, 0}, {17.25, 0, 0}}), 7), &three, true);
  const Decimals halves{{5, -3}, 0};
  expect_partition(over(cloud({{-2.5, 0, 0}, {17.25, 0, 0}}), 7), &halves, true);
}

TEST(CellTest, WideRangesOfBothScalars) {
  Random random(6);
  for (int i = 0; i < 60; ++i) {
    const Scalar scalar = i % 2 == 0 ? Scalar::float32 : Scalar::float64;
    const double scale = std::ldexp(1.0, static_cast<int>(random.below(200)) - 100);
    auto draw = [&] { return static_cast<double>(static_cast<float>((random.unit() * 2 - 1) * scale)); };
    const Lattice lattice = over(cloud({{draw(), 0, 0}, {draw(), 0, 0}}, scalar), 4 + random.below(8));
    expect_partition(lattice, nullptr, false);
    const Decimals six{{1, -20}, 6};
    expect_partition(lattice, &six, false);
    if (HasFatalFailure()) return;
  }
  const double most = 1e307;
  expect_partition(over(cloud({{-most, 0, 0}, {most, 0, 0}}, Scalar::float64), 7), nullptr, false);
}

TEST(LatticeOfMultiples, TakesTheBitsThatTheExtentNeeds) {
  const std::optional<Lattice> lattice = Lattice::of_multiples(
      cloud({{static_cast<double>(-1.5f), static_cast<double>(0.25f), 0}, {static_cast<double>(2.37f), 1, 0.5}}),
      {1, -2});
  ASSERT_TRUE(lattice);
  EXPECT_EQ(lattice->bits, 9u);
  EXPECT_EQ(lattice->origin, (std::array<std::int64_t, 3>{-150, 25, 0}));
  EXPECT_EQ(lattice->step, 0.01);
  EXPECT_EQ(lattice->min, (Position{-1.5, 0.25, 0}));
  EXPECT_TRUE(lattice->valid());
  EXPECT_EQ(lattice->snap(Position{2.37f, 1, 0.5}), (LatticePoint{387, 75, 50}));
  EXPECT_EQ(lattice->position({387, 75, 50}), (Position{2.37f, 1, 0.5}));
  EXPECT_FALSE(Lattice::of_multiples(cloud({{0, 0, 0}, {1, 0, 0}}), {1, -8}));
  EXPECT_FALSE(Lattice::of_multiples(cloud({{1e30f, 0, 0}}), {1, 0}));
}

/// A closed mesh whose coordinates are made by `make` from random numbers in (-1, 1).
template <typename Make>
TriangleMesh made_of(Make make, Scalar scalar, std::uint64_t seed) {
  TriangleMesh mesh = uv_sphere(16, 24);
  mesh.scalar = scalar;
  Random random(seed);
  for (Position& p : mesh.positions) {
    for (double& x : p) x = round_to(scalar, make(x, random));
  }
  return mesh;
}

double printed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof(text), "%.*e", digits - 1, value);
  return std::strtod(text, nullptr);
}

TEST(Exactness, DecimalsOfLimitedDigitsComeBack) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    for (int digits = 1; digits <= 17; digits += test::kSanitized ? 4 : 1) {
      for (double scale : {1e-6, 0.3, 1.0, 170.0, 1e9}) {
        const TriangleMesh mesh =
            made_of([&](double x, Random& random) { return printed((x + random.unit() * 0.01) * scale, digits); },
                    scalar, static_cast<std::uint64_t>(digits));
        ASSERT_EQ(round_trip(mesh, {}), "") << digits << " digits, scale " << scale;
      }
    }
  }
}

// What a lossless encoding of the mesh spent on exactness, bits a vertex, after its round trip.
double exactness_bits(const TriangleMesh& mesh, Encoded* encoded = nullptr) {
  Encoded result;
  EXPECT_EQ(round_trip(mesh, {}, &result), "");
  if (encoded != nullptr) *encoded = result;
  return result.report.bits.exactness / static_cast<double>(mesh.positions.size());
}

Lattice lattice_of(const Encoded& encoded) {
  const std::span<const std::byte> packet(encoded.packets[0].bytes);
  const Result<PacketHeader> of_packet = parse_packet_header(packet);
  EXPECT_TRUE(of_packet.ok());
  if (!of_packet) return {};
  const Result<BaseHeader> header = parse_base_header(packet.subspan(of_packet->size));
  EXPECT_TRUE(header.ok());
  return header ? header->lattice : Lattice();
}

TEST(Exactness, AFixedGridIsTheLattice) {
  struct Grid {
    Unit unit;
    double scale;
    unsigned bits;
  };
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    for (const Grid& grid : {Grid{{1, -3}, 30, 16}, Grid{{5, -2}, 100, 12}, Grid{{2, 1}, 1e5, 14}, Grid{{1, 0}, 120, 8},
                             Grid{{0, -10}, 1, 12}, Grid{{0, 20}, 1e9, 11}}) {
      const TriangleMesh mesh = made_of(
          [&](double x, Random&) {
            return multiple_of(grid.unit, std::llround(x * grid.scale / multiple_of(grid.unit, 1)));
          },
          scalar, 1);
      Encoded encoded;
      EXPECT_EQ(exactness_bits(mesh, &encoded), 0) << grid.scale;
      const Lattice lattice = lattice_of(encoded);
      EXPECT_TRUE(lattice.exact);
      ASSERT_TRUE(lattice.unit);
      EXPECT_EQ(*lattice.unit, grid.unit);
      EXPECT_EQ(lattice.bits, grid.bits);
    }
  }
}

TEST(Exactness, NegativeZerosAreKept) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    // On a grid, among decimals, among floats; some zeros of either sign.
    for (double unit : {1e-3, 1e-7, 0.0}) {
      const TriangleMesh mesh = made_of(
          [&](double x, Random& random) {
            if (random.one_in(5)) return random.one_in(2) ? -0.0 : 0.0;
            return unit == 0 ? x + random.unit() * 1e-3 : std::round(x / unit) * unit;
          },
          scalar, 2);
      EXPECT_EQ(round_trip(mesh, {}), "") << unit;
    }
    const TriangleMesh all = made_of([](double, Random& random) { return random.one_in(2) ? -0.0 : 0.0; }, scalar, 3);
    EXPECT_EQ(round_trip(all, {}), "");
  }
}

TEST(Exactness, OutliersCostOnlyThemselves) {
  auto grid = [](std::uint64_t one_in) {
    return made_of(
        [=](double x, Random& random) {
          return random.one_in(one_in) ? x * (1 + random.unit() * 1e-3) : std::round(x * 2000) / 2000 + 0.0;
        },
        Scalar::float32, 4);
  };
  Encoded encoded;
  EXPECT_EQ(exactness_bits(grid(1u << 30), &encoded), 0);
  EXPECT_TRUE(lattice_of(encoded).exact);
  const double few = exactness_bits(grid(100), &encoded);
  EXPECT_GT(few, 0);
  EXPECT_LT(few, 3);  // 384 vertices: some ten strays of thirty bits
}

TEST(Exactness, SixDigitsCostWhatTheyHold) {
  // Numbers of six digits, 0.1 to 1 in magnitude: a million and eight hundred thousand of them, on 2^14 indices: 122
  // each.
  const TriangleMesh mesh = made_of(
      [](double, Random& random) { return printed((random.one_in(2) ? 1 : -1) * (0.1 + 0.9 * random.unit()), 6); },
      Scalar::float32, 5);
  const double bits = exactness_bits(mesh);
  EXPECT_NEAR(bits, 3 * std::log2(2e6 / 16384), 0.8);
}

TEST(Exactness, CoordinatesThatComeAgainAreCheap) {
  // Any floats, but few different ones along each axis.
  std::vector<double> values;
  Random numbers(6);
  for (int i = 0; i < 24; ++i) values.push_back(static_cast<float>(numbers.unit()));
  TriangleMesh mesh = torus(80, 50);
  Random random(7);
  for (Position& p : mesh.positions) {
    for (double& x : p) x = values[random.below(values.size())];
  }
  EXPECT_LT(exactness_bits(mesh), 2);
}

TEST(SteppedGridTest, IsFoundUnderTheRounding) {
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    for (double step : {1.2745e-4, 7.3e-6, 0.0271828}) {
      for (bool decimal : {false, true}) {
        const double scale = step * 4000;
        const std::array<double, 3> shift{0.37 * step, 0, -0.21 * step};
        TriangleMesh mesh = uv_sphere(40, 50);
        mesh.scalar = scalar;
        for (Position& p : mesh.positions) {
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const double point = std::round(p[axis] * scale / step) * step + shift[axis];
            p[axis] = round_to(scalar, decimal ? printed(point, 6) : point);
          }
        }
        const Decimals six{{1, -14}, 6};
        const std::optional<SteppedGrid> grid = SteppedGridSearch(mesh, decimal ? &six : nullptr).find();
        ASSERT_TRUE(grid) << step;
        EXPECT_NEAR(grid->step, step, step * 1e-7);
        Encoded encoded;
        // A step found from roundings leaves some floats of so many wrong; else they cost thirty bits, and doubles a
        // hundred.
        EXPECT_LT(exactness_bits(mesh, &encoded), decimal ? 2 : 25) << step << (decimal ? ", decimals" : ", floats");
        EXPECT_EQ(lattice_of(encoded).bits, 13u);
      }
    }
  }
}

TEST(SteppedGridTest, IsNotFoundInNoise) {
  const TriangleMesh floats =
      made_of([](double x, Random& random) { return x + 1e-3 * random.unit(); }, Scalar::float32, 1);
  EXPECT_FALSE(SteppedGridSearch(floats, nullptr).find());
  EXPECT_FALSE(SteppedGridSearch(cloud({}), nullptr).find());
  EXPECT_FALSE(SteppedGridSearch(cloud({{1, 2, 3}}), nullptr).find());
  EXPECT_FALSE(SteppedGridSearch(cloud(std::vector<Position>(100, Position{1, 1, 1})), nullptr).find());
}

TEST(Exactness, TranslatedDecimalsAreStrays) {
  const TriangleMesh mesh = made_of(
      [](double x, Random&) {
        return static_cast<double>(static_cast<float>(static_cast<float>(std::round(x * 1e5) / 1e5) + 3.7f) - 3.7f);
      },
      Scalar::float32, 8);
  EXPECT_LT(exactness_bits(mesh), 3 * 7.5);  // floats cost about 3 * 9.5
}

TEST(Exactness, EveryKindOfNumberComesBack) {
  const double most = std::numeric_limits<float>::max();
  for (Scalar scalar : {Scalar::float32, Scalar::float64}) {
    const double tiny = scalar == Scalar::float32 ? kDenormal : std::numeric_limits<double>::denorm_min();
    const double huge = scalar == Scalar::float32 ? most : 2e307;
    auto expect_back = [&](auto make, const char* what) {
      EXPECT_EQ(round_trip(made_of(make, scalar, 9), {}), "") << what;
    };
    expect_back([&](double, Random& r) { return tiny * r.below(3000) - tiny * 1000; }, "denormals");
    expect_back([&](double x, Random&) { return x * (huge * 0.4); }, "huge");
    expect_back([&](double, Random& r) { return r.one_in(2) ? huge : -huge; }, "the largest");
    expect_back([&](double x, Random& r) { return std::ldexp(x, -static_cast<int>(r.below(140))); }, "many exponents");
    expect_back([&](double x, Random& r) { return r.one_in(400) ? x * 1e20 : printed(x, 4); }, "one far away");
    expect_back([&](double x, Random& r) { return printed(std::ldexp(x, -static_cast<int>(r.below(60))), 6); },
                "decimals of many exponents");
    expect_back([&](double x, Random&) { return 4e6 + printed(x, 5); }, "an offset");
    expect_back([&](double x, Random& r) { return r.one_in(2) ? printed(x, 3) : x; }, "half decimals");
    expect_back([&](double, Random& r) { return r.one_in(2) ? 5.0 : 7.0; }, "two values");
    expect_back([&](double, Random&) { return 0.1; }, "one value");
  }
}

TEST(Exactness, RandomDecimalsComeBack) {
  Random choice(10);
  for (std::uint64_t seed = 0; seed < test::rounds(150); ++seed) {
    const int digits = 1 + static_cast<int>(choice.below(12));
    const double scale = std::pow(10.0, static_cast<double>(choice.below(24)) - 12);
    const double shift = choice.one_in(3) ? scale * choice.unit() * 10 : 0;
    const std::uint64_t mixed = choice.one_in(2) ? 1u << 30 : 2 + choice.below(200);
    TriangleMesh mesh = any_mesh(seed);
    Random random(seed);
    for (Position& p : mesh.positions) {
      for (double& x : p) {
        if (std::abs(x) > 1e20) x = 1;
        x = printed((x + 0.01 * random.unit()) * scale + shift, random.one_in(mixed) ? 12 : digits);
        x = round_to(mesh.scalar, x);
      }
    }
    ASSERT_EQ(round_trip(mesh, {}), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
