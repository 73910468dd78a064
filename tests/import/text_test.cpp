// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers and lines of text files.
#include "codec/import/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace pmcd::import {
namespace {

using codec::Scalar;

double number(std::string_view token, Scalar scalar = Scalar::float32) {
  double value = -77;
  EXPECT_EQ(parse_coordinate(token, scalar, value), NumberProblem::none) << token;
  return value;
}

NumberProblem problem(std::string_view token, Scalar scalar = Scalar::float32) {
  double value = 0;
  return parse_coordinate(token, scalar, value);
}

TEST(ParseCoordinate, TakesTheNearestValue) {
  EXPECT_EQ(number("0.1"), static_cast<double>(0.1f));
  EXPECT_EQ(number("0.1", Scalar::float64), 0.1);
  EXPECT_EQ(number("+1.5"), 1.5);
  EXPECT_EQ(number("1."), 1.0);
  EXPECT_EQ(number("-.5e+1"), -5.0);
  EXPECT_TRUE(std::signbit(number("-0")));
  EXPECT_FALSE(std::signbit(number("0.0")));
  // Just above and just below the middle of 1 and the next float.
  const double next = static_cast<double>(std::nextafter(1.0f, 2.0f));
  EXPECT_EQ(number("1.00000005960464477540"), next);
  EXPECT_EQ(number("1.00000005960464477538"), 1.0);
}

TEST(ParseCoordinate, UnderflowIsRoundedNotRefused) {
  EXPECT_EQ(number("1e-45"), static_cast<double>(std::numeric_limits<float>::denorm_min()));
  EXPECT_EQ(number("1.17549435e-39"), static_cast<double>(1.17549435e-39f));
  EXPECT_EQ(number("7e-46"), 0.0);
  EXPECT_EQ(number("1e-99999999999"), 0.0);
  EXPECT_TRUE(std::signbit(number("-1e-60")));
  EXPECT_EQ(number("0e99999999999"), 0.0);
  EXPECT_EQ(number("0.00000000000000000000000000000000000000000000000000000000000001"), 0.0);
  EXPECT_EQ(number("1e-400", Scalar::float64), 0.0);
}

TEST(ParseCoordinate, OverflowIsNamed) {
  EXPECT_EQ(number("3.4028235e38"), static_cast<double>(std::numeric_limits<float>::max()));
  for (const char* huge : {"3.4028236e38", "1e39", "-1e39", "1e99999999999", "0.001e45",
                           "1000000000000000000000000000000000000000000000000000000"}) {
    EXPECT_EQ(problem(huge), NumberProblem::out_of_range) << huge;
  }
  EXPECT_EQ(problem("1e39", Scalar::float64), NumberProblem::none);
  EXPECT_EQ(problem("1e400", Scalar::float64), NumberProblem::out_of_range);
}

TEST(ParseCoordinate, RefusesWhatIsNoNumber) {
  for (const char* token : {"", ".", "1e", "1e+", "+-1", "++1", "-+1", "0x10", "1,5", "1f", "--1", "1 2", "+"}) {
    EXPECT_EQ(problem(token), NumberProblem::malformed) << token;
  }
  for (const char* token : {"nan", "-nan", "NaN", "inf", "-inf", "+inf", "Infinity", "nan(7)"}) {
    EXPECT_EQ(problem(token), NumberProblem::non_finite) << token;
  }
}

TEST(ParseInteger, TakesWholeNumbersOnly) {
  EXPECT_EQ(parse_integer("+12"), 12);
  EXPECT_EQ(parse_integer("-12"), -12);
  EXPECT_EQ(parse_integer("9223372036854775807"), std::numeric_limits<std::int64_t>::max());
  for (const char* token : {"", "1.0", "1e3", "9223372036854775808", "1x", "-", "+", "+-1"}) {
    EXPECT_EQ(parse_integer(token), std::nullopt) << token;
  }
}

TEST(LineOf, CountsEveryKindOfLineEnd) {
  const std::string_view text = "a\nb\r\nc\rd";
  EXPECT_EQ(line_of(text, 0), 1u);
  EXPECT_EQ(line_of(text, 2), 2u);
  EXPECT_EQ(line_of(text, 5), 3u);
  EXPECT_EQ(line_of(text, 7), 4u);
  EXPECT_EQ(line_of(text, 100), 4u);
}

TEST(Shown, IsFitForATerminal) {
  EXPECT_EQ(shown("abc"), "'abc'");
  EXPECT_EQ(shown("\x1b[2J"), "'?[2J'");
  EXPECT_EQ(shown(std::string(50, 'x')), "'" + std::string(40, 'x') + "...'");
}

}  // namespace
}  // namespace pmcd::import
