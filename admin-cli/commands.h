// SPDX-License-Identifier: GPL-3.0-or-later
// The commands of pmcctl: each adds itself to the command line and, if it was called, leaves its exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "admin-cli/result.h"

namespace pmcd::admin {

/// What stands before the command.
struct Common {
  std::string socket = "/run/pmcd/admin.sock";
  bool json = false;
};

void add_ingest(CLI::App& app, const Common& common, int& exit_code);
void add_list(CLI::App& app, const Common& common, int& exit_code);
void add_show(CLI::App& app, const Common& common, int& exit_code);
void add_remove(CLI::App& app, const Common& common, int& exit_code);
void add_status(CLI::App& app, const Common& common, int& exit_code);
void add_rules(CLI::App& app, const Common& common, int& exit_code);
void add_rule(CLI::App& app, const Common& common, int& exit_code);
void add_set_rule(CLI::App& app, const Common& common, int& exit_code);
void add_history(CLI::App& app, const Common& common, int& exit_code);
void add_revert(CLI::App& app, const Common& common, int& exit_code);
void add_queue(CLI::App& app, const Common& common, int& exit_code);
void add_clients(CLI::App& app, const Common& common, int& exit_code);
void add_explain(CLI::App& app, const Common& common, int& exit_code);
void add_weight(CLI::App& app, const Common& common, int& exit_code);
void add_watch(CLI::App& app, const Common& common, int& exit_code);

/// Tells a failure: a line on stderr, or with --json an object {"error": {"code", "name", "text"}} on stdout. Answers
/// its exit code.
int report(const Common& common, const std::string& command, const Failure& failure);

}  // namespace pmcd::admin
