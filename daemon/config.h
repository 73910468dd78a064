// SPDX-License-Identifier: MIT
// What the daemon is told: options of the command line, the same names in a config file, and their checks. The command
// line goes before the file, the file before the defaults. It opens nothing but the config file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <variant>

namespace pmcd {

struct Config {
  std::string database = "/var/lib/pmcd/meshes.db";
  std::string listen = "127.0.0.1";
  std::uint16_t request_port = 7621;  ///< 0: any free one
  std::uint16_t data_port = 7622;     ///< 0: any free one
  std::string admin_socket = "/run/pmcd/admin.sock";
  std::string rule = "fifo";
  std::size_t slots = 1;
  std::string log_level = "info";
  bool check_only = false;  ///< --check-config
};

/// Where an option stands and what is wrong with it, one sentence, ready to print.
struct ConfigError {
  std::string text;
};

/// --help or --version: the text to print before a successful end.
struct ConfigAnswer {
  std::string text;
};

inline constexpr std::size_t kMaxSlots = 1'024;

std::variant<Config, ConfigAnswer, ConfigError> read_config(int argc, const char* const* argv,
                                                            const std::string& version);

}  // namespace pmcd
