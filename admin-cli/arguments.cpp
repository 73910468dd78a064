// SPDX-License-Identifier: GPL-3.0-or-later
// Reading options, numbers and weights. A weight is read digit by digit: a double would not have all thousandths.
#include "admin-cli/arguments.h"

#include <algorithm>
#include <charconv>

namespace pmcd::admin {

namespace {

constexpr std::size_t kMaxTextBytes = 255;  ///< of a str8
constexpr std::size_t kDecimals = 3;
constexpr std::size_t kMaxWholeDigits = 7;  ///< of the largest weight, leading zeros included

bool all_digits(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::optional<proto::RuleOptionText> parse_option(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0 || equals > kMaxTextBytes) return std::nullopt;
  const std::string_view value = text.substr(equals + 1);
  if (value.size() > kMaxTextBytes) return std::nullopt;
  return proto::RuleOptionText{std::string(text.substr(0, equals)), std::string(value)};
}

std::optional<std::uint64_t> parse_number(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::optional<std::uint32_t> parse_weight(std::string_view text) {
  const std::size_t point = std::min(text.find('.'), text.size());
  const std::string_view whole = text.substr(0, point);
  const std::string_view part = text.substr(std::min(point + 1, text.size()));
  const bool has_point = point < text.size();
  if (whole.empty() || whole.size() > kMaxWholeDigits || part.size() > kDecimals || (has_point && part.empty()) ||
      !all_digits(whole) || !all_digits(part)) {
    return std::nullopt;
  }
  std::string thousandths(whole);
  thousandths.append(part).append(kDecimals - part.size(), '0');
  const auto weight = std::stoull(thousandths);
  if (weight == 0 || weight > proto::kMaxWeight) return std::nullopt;
  return static_cast<std::uint32_t>(weight);
}

}  // namespace pmcd::admin
