// SPDX-License-Identifier: MIT
// pmcsim: the daemon's distribution rules on links and clients that are made up. Reads the command line and calls the
// command.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "sim/commands.h"

namespace {

int run(int argc, char** argv) {
  CLI::App app{"pmcsim: simulates how pmcd's distribution rules serve many clients over one link"};
  int exit_code = pmcd::sim::kDone;
  app.set_version_flag("--version", "pmcsim " PMCD_VERSION);
  app.require_subcommand(1);
  app.footer(pmcd::sim::kExitStatus);
  pmcd::sim::add_run(app, exit_code);
  pmcd::sim::add_paper(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // CLI11 only says that a command is missing.
    const std::vector<std::string> unknown = app.remaining();
    if (app.get_subcommands().empty() && !unknown.empty()) {
      const bool is_option = unknown.front().rfind('-', 0) == 0;
      std::cerr << "pmcsim: there is no " << (is_option ? "option" : "command") << " \"" << unknown.front() << '"'
                << (is_option ? " before a command" : "") << "; pmcsim --help lists them\n";
      return pmcd::sim::kUsage;
    }
    return app.exit(error) == 0 ? pmcd::sim::kDone : pmcd::sim::kUsage;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int exit_code = run(argc, argv);
    // Whatever a command or the help has written there.
    if (!std::cout.flush()) {
      std::cerr << "pmcsim: standard output: cannot be written\n";
      return pmcd::sim::kBadInput;
    }
    return exit_code;
  } catch (const std::exception& error) {
    std::cerr << "pmcsim: " << error.what() << '\n';
    return pmcd::sim::kBadInput;
  }
}
