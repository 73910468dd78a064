// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool decode: a .pmcd file, or its first levels, becomes a mesh file.
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "client/tool/commands.h"
#include "client/tool/offline.h"
#include "codec/import/file_io.h"
#include "codec/import/ingest_file.h"
#include "codec/import/write_mesh.h"

namespace pmcd::tool {
namespace {

struct DecodeCommand {
  std::string in;
  std::string out;
  std::optional<std::uint32_t> level;
};

int run(const DecodeCommand& command) {
  const auto bytes = import::load_file(command.in);
  if (!bytes) return complain("decode", bytes.error());
  const auto mesh = import::decode_file_bytes(*bytes, command.level, command.in);
  if (!mesh) return complain("decode", mesh.error());
  const auto notes = import::write_mesh(command.out, *mesh);
  if (!notes) return complain("decode", notes.error());
  for (const std::string& note : *notes) std::cerr << "pmctool decode: " << command.out << ": note: " << note << '\n';
  std::cout << command.out << ": "
            << (command.level ? "level " + std::to_string(*command.level) : std::string("the last level")) << ", "
            << mesh->positions.size() << " vertices, " << mesh->faces.size() << " faces\n";
  return kExitDone;
}

}  // namespace

void add_decode(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("decode", "Turn packets back into a mesh file");
  const auto options = std::make_shared<DecodeCommand>();
  command->add_option("in", options->in, "File to read, something.pmcd")->required();
  command->add_option("out", options->out, "Mesh to write: .ply, .obj, .off or .stl")->required();
  command->add_option("--level", options->level, "Stop at this level (0 is the base mesh); default: the last")
      ->type_name("K");
  command->footer(
      "\nExamples:\n  pmctool decode bunny.pmcd bunny.ply\n  pmctool decode --level 3 bunny.pmcd rough.obj\n");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pmcd::tool
