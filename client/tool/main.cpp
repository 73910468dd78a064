// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool: the user's tool. Its commands stand in files of their own; here they are listed, and the exit code is made.
#include <exception>
#include <iostream>
#include <new>

#include "client/tool/commands.h"
#include "codec/import/memory.h"

namespace {

using AddCommand = void (*)(CLI::App&, int&);

// In the order of the help text.
constexpr AddCommand kCommands[] = {
    pmcd::tool::add_encode,  pmcd::tool::add_decode, pmcd::tool::add_info,
    pmcd::tool::add_compare, pmcd::tool::add_list,   pmcd::tool::add_fetch,
};

}  // namespace

int main(int argc, char** argv) {
  pmcd::import::return_large_blocks();
  // CLI11 and the standard library throw; nothing may reach the caller as a crash.
  try {
    CLI::App app{"Progressive meshes: compress, look into, compare and fetch them.", "pmctool"};
    app.set_version_flag("--version", "pmctool " PMCD_VERSION);
    app.require_subcommand(1);
    app.footer(
        "\nExamples:\n  pmctool encode bunny.ply bunny.pmcd\n  pmctool info bunny.pmcd\n"
        "  pmctool fetch localhost bunny bunny.ply\n\nExit codes: 0 done, 1 the answer is no (compare), 2 usage, 3 bad "
        "input, 4 cannot reach or refused, 128 + N ended by signal N.\n\"pmctool COMMAND --help\" tells more about a "
        "command.");
    int exit_code = pmcd::tool::kExitDone;
    for (const AddCommand add : kCommands) add(app, exit_code);
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? pmcd::tool::kExitDone : pmcd::tool::kExitUsage;
    }
    std::cout.flush();
    if (!std::cout) {
      std::cerr << "pmctool: the result cannot be written to standard output\n";
      return pmcd::tool::kExitBadInput;
    }
    return exit_code;
  } catch (const std::bad_alloc&) {
    std::cerr << "pmctool: not enough memory for this mesh\n";
  } catch (const std::exception& error) {
    std::cerr << "pmctool: " << error.what() << '\n';
  }
  return pmcd::tool::kExitBadInput;
}
