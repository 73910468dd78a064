// SPDX-License-Identifier: GPL-3.0-or-later
// What the command line asks of arguments before a command runs. Wrong ones end it with kUsage.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "admin-cli/arguments.h"

namespace pmcd::admin {

/// A whole number. CLI11 by itself takes "-1" for the largest one.
inline CLI::Validator is_number() {
  return CLI::Validator(
      [](const std::string& text) {
        return parse_number(text) ? std::string() : "\"" + text + "\" is no whole number, or too large";
      },
      "");
}

}  // namespace pmcd::admin
