// SPDX-License-Identifier: MIT
// What the daemon is told: options of the command line, the same names in a config file, and their checks. The command
// line goes before the file, the file before the defaults. The distribution policy of each is kept apart, because a
// live change goes between them. It opens nothing but the config file.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <variant>

#include "daemon/scheduler/policy.h"

namespace pmcd {

struct Config {
  std::string database = "/var/lib/pmcd/meshes.db";
  std::string listen = "127.0.0.1";
  std::uint16_t request_port = 7621;  ///< 0: any free one
  std::uint16_t data_port = 7622;     ///< 0: any free one
  std::string admin_socket = "/run/pmcd/admin.sock";
  scheduler::PolicyLayer command_line_policy;
  scheduler::PolicyLayer file_policy;
  std::size_t max_sessions = 9'000;
  std::size_t max_sessions_per_address = 256;
  std::chrono::milliseconds hello_timeout{10'000};
  std::chrono::milliseconds join_timeout{30'000};
  std::chrono::milliseconds stall_timeout{10'000};
  std::uint64_t min_rate = 500;  ///< bytes a second; 0: none
  std::chrono::milliseconds drain_timeout{5'000};
  std::chrono::milliseconds grace_time{600'000};
  std::uint64_t cache_bytes = std::uint64_t{64} << 20;  ///< 0: no cache
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

inline constexpr std::size_t kMaxSessions = 1'000'000;
inline constexpr std::uint64_t kMaxMinRate = 1'000'000'000;
inline constexpr std::chrono::milliseconds kMinTime{1};
inline constexpr std::chrono::milliseconds kMaxTime = std::chrono::hours(24);
/// The seconds that a token is good travel in 16 bits.
inline constexpr std::chrono::milliseconds kMaxJoinTime = std::chrono::hours(1);
inline constexpr std::uint64_t kMaxCacheBytes = std::uint64_t{1} << 40;

std::variant<Config, ConfigAnswer, ConfigError> read_config(int argc, const char* const* argv,
                                                            const std::string& version);

}  // namespace pmcd
