// SPDX-License-Identifier: MIT
// The commands of pmcsim, each of which adds itself to the command line and sets the exit code when it has run.
#pragma once

#include <CLI/CLI.hpp>

namespace pmcd::sim {

inline constexpr int kDone = 0;
inline constexpr int kBadInput = 1;  ///< a file is not what it should be or cannot be written; or pmcsim failed
inline constexpr int kUsage = 2;     ///< the command line does not make sense, by itself or beside a file
/// The same for people, at the end of each help.
inline constexpr const char* kExitStatus =
    "Exit status: 0 done; 1 a file is wrong or cannot be read or written; 2 the command line is wrong, or names a "
    "command, rule or option that there is not";

void add_run(CLI::App& app, int& exit_code);
void add_paper(CLI::App& app, int& exit_code);

}  // namespace pmcd::sim
