// SPDX-License-Identifier: GPL-3.0-or-later
// Digits and units.
#include "admin-cli/amounts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <span>

namespace pmcd::admin {

namespace {

constexpr const char* kNone = "-";

std::string digits(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

/// Three digits that count, as long as the number has no more before its point.
std::string three_digits(double value) {
  // What rounds up to the next power of ten has a digit more.
  if (value < 9.995) return digits(value, 2);
  if (value < 99.95) return digits(value, 1);
  return digits(value, 0);
}

/// The number in the largest unit in which it is not below 1; whole while it is in the first.
std::string with_unit(std::optional<double> value, std::span<const char* const> units, bool whole_first) {
  if (!value || !std::isfinite(*value)) return kNone;
  double number = std::max(*value, 0.0);
  std::size_t unit = 0;
  while (number >= 999.5 && unit + 1 < units.size()) {
    number /= 1000;
    ++unit;
  }
  const bool whole = number == 0 || (whole_first && unit == 0);
  return (whole ? digits(number, 0) : three_digits(number)) + " " + units[unit];
}

}  // namespace

std::string rate_text(std::optional<double> kbit_a_second) {
  static constexpr std::array kUnits{"kbit/s", "Mbit/s", "Gbit/s"};
  return with_unit(kbit_a_second, kUnits, false);
}

std::string bytes_text(std::optional<double> bytes) {
  static constexpr std::array kUnits{"B", "kB", "MB", "GB", "TB"};
  return with_unit(bytes, kUnits, true);
}

std::string seconds_text(std::optional<double> seconds) {
  if (!seconds || !std::isfinite(*seconds)) return kNone;
  const double value = std::clamp(*seconds, 0.0, 1e12);
  if (value < 599.5) return three_digits(value) + " s";
  const auto minutes = static_cast<std::int64_t>(std::llround(value / 60));
  if (minutes < 60) return std::to_string(minutes) + " min";
  return std::to_string(minutes / 60) + " h " + std::to_string(minutes % 60) + " min";
}

std::string share_text(std::optional<double> share) {
  if (!share || !std::isfinite(*share)) return kNone;
  return digits(std::clamp(*share, 0.0, 1.0) * 100, 1) + " %";
}

std::string weight_text(std::optional<double> weight) {
  if (!weight || !std::isfinite(*weight)) return kNone;
  std::string text = digits(*weight, 3);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string bar_text(double filled, std::size_t width) {
  const double part = std::isfinite(filled) ? std::clamp(filled, 0.0, 1.0) : 0.0;
  const auto full = static_cast<std::size_t>(part * static_cast<double>(width));
  return "[" + std::string(full, '#') + std::string(width - full, '.') + "]";
}

}  // namespace pmcd::admin
