// SPDX-License-Identifier: GPL-3.0-or-later
// One fetch from the command line to the file: decoding as packets come, the partial file, and what the person is told.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/address.h"

namespace pmcd::tool {

/// What stands on the command line.
struct FetchCommand {
  std::string server;
  std::string name;
  std::string out;
  std::optional<std::uint32_t> level;
  std::string each_level;
  bool resume = false;
  double give_up_after = 120;
};

/// Says on stderr what is wrong with a fetch; answers `exit_code`.
int complain(int exit_code, const std::string& text);

/// REQUIRES: a usage that makes sense. Writes to stderr and stdout; answers the exit code.
int run_fetch(const FetchCommand& command, const client::Address& address);

}  // namespace pmcd::tool
