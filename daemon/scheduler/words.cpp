// SPDX-License-Identifier: MIT
// Rounding for people.
#include "daemon/scheduler/words.h"

#include <algorithm>
#include <array>
#include <charconv>

namespace pmcd::scheduler {

std::string number_text(double number) {
  // Whole from a thousand on, else three digits that count.
  std::array<char, 64> text{};
  const bool large = number >= 1000 && number < 1e15;
  const auto end = large ? std::to_chars(text.begin(), text.end(), number, std::chars_format::fixed, 0)
                         : std::to_chars(text.begin(), text.end(), number, std::chars_format::general, 3);
  return {text.begin(), end.ptr};
}

std::string seconds_text(double seconds) {
  return number_text(seconds) + " s";
}

std::string age_text(Time since, Time now) {
  return seconds_text(std::chrono::duration<double>(std::max(now - since, Time{0})).count());
}

std::string bytes_text(std::uint64_t bytes) {
  if (bytes < 1000) return std::to_string(bytes) + " B";
  const bool mega = bytes >= 1'000'000;
  return number_text(static_cast<double>(bytes) / (mega ? 1e6 : 1e3)) + (mega ? " MB" : " kB");
}

}  // namespace pmcd::scheduler
