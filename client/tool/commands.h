// SPDX-License-Identifier: GPL-3.0-or-later
// The subcommands of pmctool, one file each. A command sets the exit code and writes errors to stderr itself; no
// exception of ours leaves it.
#pragma once

#include <CLI/CLI.hpp>

namespace pmcd::tool {

// What pmctool ends with; part of its interface.
inline constexpr int kExitDone = 0;
inline constexpr int kExitNo = 1;        ///< the answer is no (compare)
inline constexpr int kExitUsage = 2;     ///< options that make no sense
inline constexpr int kExitBadInput = 3;  ///< a file that cannot be read, understood or written
inline constexpr int kExitRefused = 4;   ///< a server that cannot be reached or that refuses
inline constexpr int kExitSignal = 128;  ///< plus the number of the signal that ended it

/// Each adds its subcommand to `app`; when the user asks for it, it runs while `app` parses and sets `exit_code`, which
/// must live as long as `app`.
void add_encode(CLI::App& app, int& exit_code);
void add_decode(CLI::App& app, int& exit_code);
void add_info(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_list(CLI::App& app, int& exit_code);
void add_fetch(CLI::App& app, int& exit_code);

}  // namespace pmcd::tool
