// SPDX-License-Identifier: GPL-3.0-or-later
// What the command line asks of arguments before a command runs. Wrong ones end it with kUsage.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>

#include "admin-cli/arguments.h"

namespace pmcd::admin {

/// A whole number. CLI11 by itself takes "-1" for the largest one.
inline CLI::Validator is_number(std::uint64_t most = UINT64_MAX) {
  return CLI::Validator(
      [most](const std::string& text) {
        const auto number = parse_number(text);
        return number && *number <= most ? std::string() : "\"" + text + "\" is no whole number, or too large";
      },
      "");
}

/// A number of that range. CLI11's own check lets "nan" pass.
inline CLI::Validator is_from_to(double least, double most, const std::string& range) {
  return CLI::Validator(
      [=](const std::string& text) {
        double number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        const bool right =
            error == std::errc() && end == text.data() + text.size() && number >= least && number <= most;
        return right ? std::string() : "\"" + text + "\" is no number from " + range;
      },
      "");
}

}  // namespace pmcd::admin
