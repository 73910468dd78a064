// SPDX-License-Identifier: MIT
// What decoding spends time on: what each effort chooses, and that whatever a stream says comes back.
#include "codec/encoder/spending.h"

#include <gtest/gtest.h>

#include <utility>

#include "codec/encoder/encoding_plan.h"
#include "codec/encoder/variant.h"
#include "codec/proof.h"
#include "tests/codec/generated.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {
namespace {

TEST(SpendingTest, StandardEffortSpendsOnPlanesOnly) {
  for (const std::size_t vertices : {std::size_t{10}, std::size_t{1'000'000}}) {
    for (const Alignment alignment : {Alignment::none, Alignment::some, Alignment::planes}) {
      const Spending spending = plan_spending(Effort::standard, alignment, vertices);
      EXPECT_EQ(spending.guessing, Guessing::never);
      EXPECT_EQ(spending.clear, 0u);
      EXPECT_EQ(spending.structure, alignment == Alignment::planes ? Structure::values : Structure::none);
    }
  }
}

TEST(SpendingTest, BestEffortLooksAtAllFacesOfMeshesThatAreNotLarge) {
  EXPECT_EQ(plan_spending(Effort::best, Alignment::none, 100'000).clear, kNoneClear);
  EXPECT_EQ(plan_spending(Effort::best, Alignment::none, 100'001).clear, 4u);
  EXPECT_EQ(plan_spending(Effort::best, Alignment::none, 5).guessing, Guessing::often);
  EXPECT_EQ(plan_spending(Effort::best, Alignment::none, 5).structure, Structure::none);
  EXPECT_EQ(plan_spending(Effort::best, Alignment::some, 5).structure, Structure::all);
  EXPECT_EQ(plan_spending(Effort::best, Alignment::planes, 5).structure, Structure::all);
}

// The mesh with a cleaning conquest, spent on like this: bits of connectivity, nothing if it does not come back.
double connectivity_bits(const TriangleMesh& mesh, const Spending& spending) {
  HalfEdgeMesh built;
  Result<EncodingPlan> plan = make_plan(mesh, 10, built);
  if (!plan) return 0;
  DecimationOptions options;
  options.cleaning = true;
  std::optional<Descent> descent = descend(std::move(built), *plan, options, {});
  if (!descent) return 0;
  Result<Variant> variant = write_variant(*plan, *descent, Passes::use_up, {Effort::standard, spending, std::nullopt},
                                          [](double) { return true; });
  if (!variant) return 0;
  const double bits = variant->bits.connectivity;
  const Encoded encoded{std::move(variant->packets), {}, {plan->lossless, plan->lattice, variant->to_original}};
  return prove(encoded, mesh).ok() ? bits : 0;
}

TEST(SpendingTest, WhateverItIsTheMeshComesBack) {
  Random random(77);
  TriangleMesh mesh = joined(sphere(3), grid(12, 9, 4));
  jitter(mesh, 0.01, random);
  for (const Guessing guessing : {Guessing::never, Guessing::often}) {
    for (const Structure structure : {Structure::none, Structure::values, Structure::all}) {
      double before = 0;
      for (std::uint32_t clear = 0; clear <= kNoneClear; ++clear) {
        const double bits = connectivity_bits(mesh, {guessing, clear, structure});
        ASSERT_GT(bits, 0) << clear << " sevenths";
        if (clear > 0) {
          EXPECT_NE(bits, before) << clear << " sevenths are coded like one less";
        }
        before = bits;
      }
    }
  }
}

}  // namespace
}  // namespace pmcd::codec::testing
