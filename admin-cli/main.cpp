// SPDX-License-Identifier: GPL-3.0-or-later
// pmcctl: the operator's tool. Reads the command line and calls the command; knows nothing of meshes or sockets.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "admin-cli/commands.h"
#include "codec/import/memory.h"

namespace {

int run(int argc, char** argv) {
  CLI::App app{"pmcctl: stores meshes in a running pmcd, shows what it has and says who is served next"};
  pmcd::admin::Common common;
  int exit_code = pmcd::admin::kDone;
  app.add_option("--socket", common.socket, "The daemon's admin socket")->envname("PMCD_SOCKET")->capture_default_str();
  app.add_flag("--json", common.json, "Print JSON");
  app.set_version_flag("--version", "pmcctl " PMCD_VERSION);
  app.require_subcommand(1);
  app.fallthrough();
  pmcd::admin::add_ingest(app, common, exit_code);
  pmcd::admin::add_list(app, common, exit_code);
  pmcd::admin::add_show(app, common, exit_code);
  pmcd::admin::add_remove(app, common, exit_code);
  pmcd::admin::add_status(app, common, exit_code);
  pmcd::admin::add_rules(app, common, exit_code);
  pmcd::admin::add_rule(app, common, exit_code);
  pmcd::admin::add_set_rule(app, common, exit_code);
  pmcd::admin::add_history(app, common, exit_code);
  pmcd::admin::add_revert(app, common, exit_code);
  pmcd::admin::add_queue(app, common, exit_code);
  pmcd::admin::add_clients(app, common, exit_code);
  pmcd::admin::add_explain(app, common, exit_code);
  pmcd::admin::add_weight(app, common, exit_code);
  pmcd::admin::add_watch(app, common, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // CLI11 only says that a command is missing.
    const std::vector<std::string> unknown = app.remaining();
    if (app.get_subcommands().empty() && !unknown.empty() && unknown.front().front() != '-') {
      std::cerr << "there is no command \"" << unknown.front() << "\"; pmcctl --help lists them\n";
      return pmcd::admin::kUsage;
    }
    // Help and version are no errors; everything else is wrong usage.
    return app.exit(error) == 0 ? pmcd::admin::kDone : pmcd::admin::kUsage;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  pmcd::import::return_large_blocks();
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "pmcctl: " << error.what() << '\n';
    return pmcd::admin::kBadInput;
  }
}
