// SPDX-License-Identifier: MIT
// The options as they are written: their names, what stands on the command line and in the config file, and where. What
// the values mean is judged in config.cpp.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>

#include "daemon/config.h"

namespace pmcd {

/// A value and where it was given: "--slots" or "pmcd.conf:3: slots".
struct Given {
  std::string value;
  std::string where;
};

/// By the option's name; an option of a rule stands under "rule-option NAME".
using GivenValues = std::map<std::string, Given>;

inline constexpr const char* kRuleOption = "rule-option";

struct CommandLine {
  GivenValues values;
  std::optional<std::string> file;  ///< --config
  bool check_only = false;          ///< --check-config
};

/// ConfigAnswer: --help or --version came first.
std::variant<CommandLine, ConfigAnswer, ConfigError> read_command_line(int argc, const char* const* argv,
                                                                       const std::string& version);

std::variant<GivenValues, ConfigError> read_config_file(const std::string& path);

}  // namespace pmcd
