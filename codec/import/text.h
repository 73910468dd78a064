// SPDX-License-Identifier: GPL-3.0-or-later
// Text files as the readers see them: lines with comments taken off, tokens, numbers. Independent of the locale. It
// knows no mesh format.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "codec/mesh/triangle_mesh.h"

namespace pmcd::import {

/// The line, counted from 1, in which byte `place` of `text` stands. LF, CRLF and lone CR each end a line.
std::uint64_t line_of(std::string_view text, std::uint64_t place);

/// Walks over the lines of a text that hold anything.
class Lines {
 public:
  struct Style {
    bool hash_comments = false;  ///< '#' starts a comment, anywhere in a line
    bool backslash_continues = false;
  };
  Lines(std::string_view text, std::size_t start, Style style) : text_(text), next_(start), style_(style) {}

  /// Goes to the next line that is not blank after its comment was taken off; false at the end of the text.
  bool next();
  /// The line without comment and line end; valid until next().
  [[nodiscard]] std::string_view line() const { return line_; }
  /// Byte at which the line starts; at the end, the size of the text.
  [[nodiscard]] std::uint64_t place() const { return place_; }

 private:
  std::string_view take_physical_line();

  std::string_view text_;
  std::size_t next_;
  Style style_;
  std::string_view line_;
  std::string joined_;
  std::uint64_t place_ = 0;
};

/// Tokens of a line, separated by spaces and tabs.
class Tokens {
 public:
  explicit Tokens(std::string_view line) : rest_(line) {}
  /// The next token; empty at the end.
  std::string_view next();

 private:
  std::string_view rest_;
};

enum class NumberProblem : std::uint8_t { none, malformed, non_finite, out_of_range };

/// A token as the nearest value of `scalar`; below the smallest one it becomes zero with its sign. A leading '+' is
/// taken.
NumberProblem parse_coordinate(std::string_view token, codec::Scalar scalar, double& value);

/// True if float32 can hold the value exactly.
bool is_float32(double value);

/// Whole numbers with an optional sign; none if the token is anything else or does not fit into 64 bits.
std::optional<std::int64_t> parse_integer(std::string_view token);

/// A token for a message: quoted, cut to a decent length, unprintable bytes replaced.
std::string shown(std::string_view token);

/// True if two names are equal but for ASCII case.
bool equal_ignoring_case(std::string_view a, std::string_view b);

}  // namespace pmcd::import
