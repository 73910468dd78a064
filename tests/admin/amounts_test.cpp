// SPDX-License-Identifier: GPL-3.0-or-later
// Amounts: three digits that count, the right unit on both sides of each border, nothing odd for odd numbers.
#include "admin-cli/amounts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace pmcd::admin {
namespace {

TEST(Amounts, Rates) {
  EXPECT_EQ(rate_text(0.0), "0 kbit/s");
  EXPECT_EQ(rate_text(0.5), "0.50 kbit/s");
  EXPECT_EQ(rate_text(33.6), "33.6 kbit/s");
  EXPECT_EQ(rate_text(999.4), "999 kbit/s");
  EXPECT_EQ(rate_text(999.5), "1.00 Mbit/s");
  EXPECT_EQ(rate_text(5'000.0), "5.00 Mbit/s");
  EXPECT_EQ(rate_text(1e6), "1.00 Gbit/s");
  EXPECT_EQ(rate_text(2.5e9), "2500 Gbit/s") << "there is no larger unit";
}

TEST(Amounts, Bytes) {
  EXPECT_EQ(bytes_text(0.0), "0 B");
  EXPECT_EQ(bytes_text(812.0), "812 B");
  EXPECT_EQ(bytes_text(34'100.0), "34.1 kB");
  EXPECT_EQ(bytes_text(9'994.0), "9.99 kB");
  EXPECT_EQ(bytes_text(9'996.0), "10.0 kB") << "not 10.00";
  EXPECT_EQ(bytes_text(99'960.0), "100 kB") << "not 100.0";
  EXPECT_EQ(bytes_text(2'000'000'000.0), "2.00 GB");
}

TEST(Amounts, Seconds) {
  EXPECT_EQ(seconds_text(0.123), "0.12 s");
  EXPECT_EQ(seconds_text(75.0), "75.0 s");
  EXPECT_EQ(seconds_text(599.0), "599 s");
  EXPECT_EQ(seconds_text(600.0), "10 min");
  EXPECT_EQ(seconds_text(3'599.0), "1 h 0 min");
  EXPECT_EQ(seconds_text(11'100.0), "3 h 5 min");
  EXPECT_EQ(seconds_text(-1.0), "0.00 s") << "a clock that was set back";
}

TEST(Amounts, Shares) {
  EXPECT_EQ(share_text(0.1234), "12.3 %");
  EXPECT_EQ(share_text(1.0), "100.0 %");
  EXPECT_EQ(share_text(7.0), "100.0 %");
}

TEST(Amounts, Weights) {
  EXPECT_EQ(weight_text(1.0), "1");
  EXPECT_EQ(weight_text(0.001), "0.001");
  EXPECT_EQ(weight_text(2.5), "2.5");
  EXPECT_EQ(weight_text(12'345.678), "12345.678");
  EXPECT_EQ(weight_text(1'000'000.0), "1000000");
}

TEST(Amounts, NoneIsADash) {
  const double nan = std::nan("");
  const double infinite = std::numeric_limits<double>::infinity();
  for (const std::optional<double> none : {std::optional<double>(), std::optional(nan), std::optional(infinite)}) {
    EXPECT_EQ(rate_text(none), "-");
    EXPECT_EQ(bytes_text(none), "-");
    EXPECT_EQ(seconds_text(none), "-");
    EXPECT_EQ(share_text(none), "-");
    EXPECT_EQ(weight_text(none), "-");
  }
}

TEST(Amounts, Bars) {
  EXPECT_EQ(bar_text(0, 4), "[....]");
  EXPECT_EQ(bar_text(0.5, 4), "[##..]");
  EXPECT_EQ(bar_text(0.99, 4), "[###.]") << "full only when it is";
  EXPECT_EQ(bar_text(1, 4), "[####]");
  EXPECT_EQ(bar_text(3, 4), "[####]");
  EXPECT_EQ(bar_text(-1, 4), "[....]");
  EXPECT_EQ(bar_text(std::nan(""), 4), "[....]");
}

}  // namespace
}  // namespace pmcd::admin
