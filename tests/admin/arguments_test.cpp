// SPDX-License-Identifier: GPL-3.0-or-later
// Arguments: what is taken, what is refused, and that a weight is exact.
#include "admin-cli/arguments.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdio>
#include <limits>

namespace pmcd::admin {
namespace {

using proto::RuleOptionText;

TEST(Arguments, OptionsAreCutAtTheFirstEquals) {
  EXPECT_EQ(parse_option("burst=2"), (RuleOptionText{"burst", "2"}));
  EXPECT_EQ(parse_option("a=b=c"), (RuleOptionText{"a", "b=c"}));
  EXPECT_EQ(parse_option("a="), (RuleOptionText{"a", ""}));
  EXPECT_EQ(parse_option("burst"), std::nullopt);
  EXPECT_EQ(parse_option("=2"), std::nullopt);
  EXPECT_EQ(parse_option(""), std::nullopt);
}

TEST(Arguments, OptionsThatWouldBeCutOnTheWayAreRefused) {
  const std::string longest(255, 'x');
  EXPECT_EQ(parse_option(longest + "=" + longest), (RuleOptionText{longest, longest}));
  EXPECT_EQ(parse_option(longest + "x=1"), std::nullopt);
  EXPECT_EQ(parse_option("a=x" + longest), std::nullopt);
}

TEST(Arguments, Numbers) {
  EXPECT_EQ(parse_number("0"), 0u);
  EXPECT_EQ(parse_number("18446744073709551615"), std::numeric_limits<std::uint64_t>::max());
  for (const char* wrong : {"", "-1", "+1", " 1", "1 ", "0x10", "1.0", "1e3", "18446744073709551616"}) {
    EXPECT_EQ(parse_number(wrong), std::nullopt) << wrong;
  }
}

TEST(Arguments, Weights) {
  EXPECT_EQ(parse_weight("1"), 1'000u);
  EXPECT_EQ(parse_weight("2.5"), 2'500u);
  EXPECT_EQ(parse_weight("0.001"), 1u);
  EXPECT_EQ(parse_weight("1000000"), 1'000'000'000u);
  EXPECT_EQ(parse_weight("0000002"), 2'000u);
  for (const char* wrong : {"", "0", "0.000", "0.0004", "1.2345", "1000000.001", "10000000", "-1", "1.", ".5", "1e3",
                            "x", "1,5", "1.5.1", " 1"}) {
    EXPECT_EQ(parse_weight(wrong), std::nullopt) << wrong;
  }
}

TEST(Arguments, EveryThousandthIsItself) {
  EXPECT_TRUE(rc::check("a weight written with three decimals is that weight", [] {
    const auto weight = *rc::gen::inRange<std::uint32_t>(1, proto::kMaxWeight + 1);
    char text[32];
    std::snprintf(text, sizeof text, "%u.%03u", weight / 1000, weight % 1000);
    RC_ASSERT(parse_weight(text) == weight);
  }));
}

}  // namespace
}  // namespace pmcd::admin
