// SPDX-License-Identifier: GPL-3.0-or-later
// Lines, tokens and numbers of text files.
#include "codec/import/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace pmcd::import {
namespace {

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r';
}

std::string_view trim(std::string_view s) {
  while (!s.empty() && is_space(s.front())) s.remove_prefix(1);
  while (!s.empty() && is_space(s.back())) s.remove_suffix(1);
  return s;
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// Whether a decimal number that from_chars found out of range is too large rather than too small: the decimal exponent
/// of its first non-zero digit tells. REQUIRES: `token` is a decimal number without leading '+'.
bool is_huge(std::string_view token) {
  const std::size_t e = token.find_first_of("eE");
  const std::string_view mantissa = token.substr(0, e);
  const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
  const std::size_t first = mantissa.find_first_of("123456789");
  if (first == std::string_view::npos) return false;
  // Position of the first digit relative to the point, as a power of ten.
  double power = first < point ? static_cast<double>(point - first) : -static_cast<double>(first - point);
  if (e != std::string_view::npos) {
    std::string_view digits = token.substr(e + 1);
    const bool negative = !digits.empty() && digits.front() == '-';
    double exponent = 0;
    for (const char c : digits) {
      if (c >= '0' && c <= '9') exponent = exponent * 10 + (c - '0');
    }
    power += negative ? -exponent : exponent;
  }
  return power > 0;
}

template <typename Float>
NumberProblem parse_as(std::string_view token, double& value) {
  Float parsed = 0;
  const char* const end = token.data() + token.size();
  const auto [stop, problem] = std::from_chars(token.data(), end, parsed);
  if (problem == std::errc::invalid_argument || stop != end) return NumberProblem::malformed;
  if (problem == std::errc::result_out_of_range) {
    if (is_huge(token)) return NumberProblem::out_of_range;
    parsed = token.front() == '-' ? -Float{0} : Float{0};
  }
  if (!std::isfinite(parsed)) return NumberProblem::non_finite;
  value = static_cast<double>(parsed);
  return NumberProblem::none;
}

/// from_chars takes no leading '+'; "+-1" must stay malformed.
std::string_view without_plus(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-' && token[1] != '+') token.remove_prefix(1);
  return token;
}

}  // namespace

std::uint64_t line_of(std::string_view text, std::uint64_t place) {
  const std::size_t end = std::min<std::uint64_t>(place, text.size());
  std::uint64_t line = 1;
  for (std::size_t i = 0; i < end; ++i) {
    if (text[i] == '\n' || (text[i] == '\r' && (i + 1 >= text.size() || text[i + 1] != '\n'))) ++line;
  }
  return line;
}

std::string_view Lines::take_physical_line() {
  const std::size_t start = next_;
  std::size_t end = start;
  while (end < text_.size() && text_[end] != '\n' && text_[end] != '\r') ++end;
  next_ = end;
  if (next_ < text_.size())
    next_ += text_[next_] == '\r' && next_ + 1 < text_.size() && text_[next_ + 1] == '\n' ? 2 : 1;
  return text_.substr(start, end - start);
}

bool Lines::next() {
  while (next_ < text_.size()) {
    place_ = next_;
    line_ = take_physical_line();
    const auto drop_comment = [&] {
      if (style_.hash_comments) line_ = line_.substr(0, line_.find('#'));
    };
    drop_comment();
    if (style_.backslash_continues && trim(line_).ends_with('\\')) {
      joined_.clear();
      while (trim(line_).ends_with('\\')) {
        joined_ += trim(line_);
        joined_.back() = ' ';
        line_ = {};
        if (next_ >= text_.size()) break;
        line_ = take_physical_line();
        drop_comment();
      }
      joined_ += line_;
      line_ = joined_;
    }
    if (!trim(line_).empty()) return true;
  }
  place_ = text_.size();
  line_ = {};
  return false;
}

std::string_view Tokens::next() {
  std::size_t start = 0;
  while (start < rest_.size() && is_space(rest_[start])) ++start;
  std::size_t end = start;
  while (end < rest_.size() && !is_space(rest_[end])) ++end;
  const std::string_view token = rest_.substr(start, end - start);
  rest_.remove_prefix(end);
  return token;
}

NumberProblem parse_coordinate(std::string_view token, codec::Scalar scalar, double& value) {
  token = without_plus(token);
  if (token.empty()) return NumberProblem::malformed;
  return scalar == codec::Scalar::float64 ? parse_as<double>(token, value) : parse_as<float>(token, value);
}

bool is_float32(double value) {
  // Beyond float's range the conversion would be undefined.
  return std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()) &&
         static_cast<double>(static_cast<float>(value)) == value;
}

std::optional<std::int64_t> parse_integer(std::string_view token) {
  token = without_plus(token);
  std::int64_t value = 0;
  const char* const end = token.data() + token.size();
  const auto [stop, problem] = std::from_chars(token.data(), end, value);
  if (problem != std::errc{} || stop != end) return std::nullopt;
  return value;
}

std::string shown(std::string_view token) {
  constexpr std::size_t kLongest = 40;
  std::string out = "'";
  for (const char c : token.substr(0, kLongest)) out += c >= ' ' && c <= '~' ? c : '?';
  if (token.size() > kLongest) out += "...";
  return out + "'";
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace pmcd::import
