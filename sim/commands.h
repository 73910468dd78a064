// SPDX-License-Identifier: MIT
// The commands of pmcsim, each of which adds itself to the command line and sets the exit code when it has run.
#pragma once

#include <CLI/CLI.hpp>

namespace pmcd::sim {

inline constexpr int kDone = 0;
inline constexpr int kUsage = 2;     ///< the command line does not make sense
inline constexpr int kBadInput = 1;  ///< a file or value is not what it should be

void add_run(CLI::App& app, int& exit_code);
void add_paper(CLI::App& app, int& exit_code);

}  // namespace pmcd::sim
