// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool fetch: its options, and whether they make sense. fetch_run.cpp does the work.
#include <memory>
#include <optional>
#include <string>

#include "client/tool/commands.h"
#include "client/tool/fetch_run.h"
#include "codec/import/file_io.h"
#include "codec/import/write_mesh.h"

namespace pmcd::tool {

namespace {

/// A complaint about a request that cannot be right, before anything is asked of the server.
std::optional<std::string> check_usage(const FetchCommand& command) {
  const std::string extension = import::extension_of(command.out);
  if (extension == "pmcd") {
    if (command.level) return "a .pmcd file holds the whole mesh: leave --level out, or write PLY, OBJ, OFF or STL";
    return std::nullopt;
  }
  const auto formatted = import::format_mesh({}, extension);
  if (!formatted && formatted.error().code == import::ImportErrorCode::unknown_extension) {
    return "\"" + command.out + "\": the name does not say which format; end it in .ply, .obj, .off, .stl or .pmcd";
  }
  return std::nullopt;
}

int run(const FetchCommand& command) {
  const auto address = client::parse_address(command.server);
  if (!address) return complain(kExitUsage, address.error().text);
  if (const auto wrong = check_usage(command)) return complain(kExitUsage, *wrong);
  return run_fetch(command, *address);
}

}  // namespace

void add_fetch(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("fetch", "Fetch a mesh from a server, level by level");
  const auto options = std::make_shared<FetchCommand>();
  command->add_option("server", options->server, "HOST[:PORT]; an IPv6 address in brackets")->required();
  command->add_option("name", options->name, "Name of the mesh")->required();
  command->add_option("out", options->out, "File to write: .ply, .obj, .off, .stl, or .pmcd for the packets")
      ->required();
  command->add_option("--level", options->level, "Stop at this level (0 is the base mesh); default: the last")
      ->type_name("K");
  command->add_option("--each-level", options->each_level, "Also write each level into this folder")
      ->type_name("FOLDER");
  command->add_flag("--resume", options->resume,
                    "Go on with OUT.part, which a run that was ended leaves behind; without one, begin");
  command
      ->add_option("--give-up-after", options->give_up_after,
                   "When the line is lost: try again until nothing has come for so long (0: not at all)")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str()
      ->type_name("SECONDS");
  command->footer(
      "\nWhat has come is kept in OUT.part until OUT is written. If pmctool is ended before, by Ctrl-C or worse, the\n"
      "same command with --resume checks what is there and goes on at the byte that was reached. If the mesh has "
      "changed\n"
      "on the server, it says so and begins anew. Without --resume a file OUT.part is not touched: the command "
      "refuses.\n"
      "Ended by a signal, pmctool ends with 128 + the signal (Ctrl-C: 130).\n"
      "\nExamples:\n  pmctool fetch localhost bunny bunny.ply\n  pmctool fetch --resume localhost bunny bunny.ply\n"
      "  pmctool fetch --level 3 --each-level levels/ [::1]:7621 bunny rough.obj\n");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pmcd::tool
