// SPDX-License-Identifier: MIT
// Images under a reflection: where they lie, which are found, which is chosen; and finding the reflection itself.
#include "codec/geometry/reflection.h"

#include <gtest/gtest.h>

#include <vector>

#include "codec/encoder/reflection_search.h"
#include "tests/codec/generated.h"

namespace pmcd::codec::testing {
namespace {

constexpr std::int32_t kMostPoint = 4095;

Reflection flip_x(std::int32_t sum) {
  Reflection reflection;
  reflection.flips[0] = true;
  reflection.sum[0] = sum;
  return reflection;
}

TEST(Reflection, FlipsTheAxesThatItNames) {
  EXPECT_FALSE(Reflection().any());
  EXPECT_EQ(Reflection().image({1, 2, 3}), (LatticePoint{1, 2, 3}));
  const Reflection reflection = flip_x(100);
  EXPECT_TRUE(reflection.any());
  EXPECT_EQ(reflection.image({30, 2, 3}), (LatticePoint{70, 2, 3}));
  EXPECT_EQ(reflection.image(reflection.image({30, 2, 3})), (LatticePoint{30, 2, 3}));
}

TEST(Images, NearOnesAreFoundTheLatestFirst) {
  Images images;
  images.begin(flip_x(2 * kMostPoint), 1000, 2 * kMostPoint);  // buckets of 2^7 half steps
  images.add({2 * kMostPoint - 500, 600, 700});
  images.add({2 * kMostPoint - 502, 602, 700});
  images.add({2 * kMostPoint - 5000, 600, 700});
  const Images::Nearby nearby = images.near({505, 600, 690});
  ASSERT_EQ(nearby.size, 2u);
  EXPECT_EQ(nearby.image[0], (LatticePoint{502, 602, 700}));
  EXPECT_EQ(nearby.image[1], (LatticePoint{500, 600, 700}));
  EXPECT_EQ(images.near({505, 600, 2000}).size, 0u);
}

TEST(Images, ManyInOnePlaceAreBounded) {
  Images images;
  images.begin(flip_x(0), 100'000, 2 * kMostPoint);
  for (int i = 0; i < 1000; ++i) images.add({0, 0, 0});
  EXPECT_EQ(images.near({0, 0, 0}).size, Images::kMost);
}

TEST(Images, TheBestFitsWhatIsKnown) {
  Images::Nearby nearby;
  nearby.image[0] = {2 * 10, 2 * 20, 2 * 30};
  nearby.image[1] = {2 * 12, 2 * 20, 2 * 31};
  nearby.image[2] = {2 * 12, 2 * 40, 2 * 33};
  nearby.size = 3;
  const std::array<std::size_t, 3> order = {0, 1, 2};
  std::int32_t value = -1;
  // Nothing is known: the expectation decides; the second lies almost as near.
  EXPECT_EQ(best_image(nearby, order, 0, {}, {10.4, 20, 30}, 2, 0, value), 2u);
  EXPECT_EQ(value, 10);
  // The first coordinate is known to be 12.
  EXPECT_EQ(best_image(nearby, order, 1, {12, 0, 0}, {10.4, 20, 30}, 2, 0, value), 1u);
  EXPECT_EQ(value, 20);
  EXPECT_EQ(best_image(nearby, order, 2, {12, 40, 0}, {10.4, 20, 30}, 2, 0, value), 1u);
  EXPECT_EQ(value, 33);
  value = -1;
  EXPECT_EQ(best_image(nearby, order, 0, {}, {100, 200, 300}, 1, 0, value), 0u) << "all are too far";
  EXPECT_EQ(value, -1);
}

std::vector<LatticePoint> cloud(bool mirrored) {
  Random random(5);
  std::vector<LatticePoint> points = {{0, 0, 0}, {kMostPoint, kMostPoint, kMostPoint}};
  for (int i = 0; i < 500; ++i) {
    const LatticePoint p{static_cast<std::int32_t>(random.below(kMostPoint)),
                         static_cast<std::int32_t>(random.below(kMostPoint)),
                         static_cast<std::int32_t>(random.below(kMostPoint))};
    points.push_back(p);
    if (mirrored) points.push_back({p[0], kMostPoint - p[1], p[2]});
  }
  return points;
}

TEST(ReflectionSearch, FindsTheAxisAndTheCentre) {
  const Reflection found = find_reflection(cloud(true), kMostPoint, {});
  EXPECT_EQ(found.flips, (std::array<bool, 3>{false, true, false}));
  EXPECT_EQ(found.sum[1], 2 * kMostPoint);
  EXPECT_FALSE(find_reflection(cloud(false), kMostPoint, {}).any());
  EXPECT_FALSE(find_reflection({}, kMostPoint, {}).any());
}

}  // namespace
}  // namespace pmcd::codec::testing
