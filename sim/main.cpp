// SPDX-License-Identifier: MIT
// pmcsim: the daemon's distribution rules on links and clients that are made up. Reads the command line and calls the
// command.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "sim/commands.h"

namespace {

int run(int argc, char** argv) {
  CLI::App app{"pmcsim: simulates how pmcd's distribution rules serve many clients over one link"};
  int exit_code = pmcd::sim::kDone;
  app.set_version_flag("--version", "pmcsim " PMCD_VERSION);
  app.require_subcommand(1);
  pmcd::sim::add_run(app, exit_code);
  pmcd::sim::add_paper(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? pmcd::sim::kDone : pmcd::sim::kUsage;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "pmcsim: " << error.what() << '\n';
    return pmcd::sim::kBadInput;
  }
}
