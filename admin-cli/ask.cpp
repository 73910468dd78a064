// SPDX-License-Identifier: GPL-3.0-or-later
// The commands about meshes and the daemon itself that ask for a document and print it: list, show, remove, status.
#include <iostream>
#include <memory>
#include <string>

#include "admin-cli/commands.h"
#include "admin-cli/conversation.h"
#include "admin-cli/document.h"
#include "proto/admin.h"
#include "proto/text.h"

namespace pmcd::admin {

namespace {

/// Asks about a name; a name that cannot be one is refused here.
template <typename M>
int run_named(const Common& common, const std::string& command, const std::string& name, Print print) {
  if (!proto::is_mesh_name(name)) {
    return report(common, command,
                  {kUsage, proto::ErrorCode::bad_name,
                   "this is no name of a mesh: 1 to 128 bytes of printable UTF-8 without a slash"});
  }
  return run(common, command, M{0, name}, print);
}

void print_list(const ordered_json& document) {
  print_lines(table_of(rows_of(document, "meshes"), {"name", "vertices", "faces", "packets", "bytes", "generation"}));
  for (const ordered_json& mesh : rows_of(document, "damaged")) {
    std::cerr << "pmcctl list: mesh \"" << field(mesh, "name") << "\" is damaged: " << field(mesh, "error")
              << "; ingest it again with --replace, or remove it\n";
  }
}

void print_mesh(const ordered_json& document) {
  print_lines(field_lines(document));
  std::cout << '\n';
  print_lines(
      table_of(rows_of(document, "levels"), {"level", "bytes", "vertices", "faces", "bits", "error_rms", "error_max"}));
}

void print_removed(const ordered_json& document) {
  std::cout << "removed " << field(document, "removed") << " (generation " << field(document, "generation") << ")\n";
}

}  // namespace

void add_list(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("list", "Show the meshes that are stored");
  command->callback([&common, &exit_code] { exit_code = run(common, "list", proto::AdminList{}, print_list); });
}

void add_show(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("show", "Show one mesh and its levels");
  const auto name = std::make_shared<std::string>();
  command->add_option("name", *name, "Name of the mesh")->required();
  command->callback(
      [name, &common, &exit_code] { exit_code = run_named<proto::AdminShow>(common, "show", *name, print_mesh); });
}

void add_remove(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("remove", "Remove a mesh");
  const auto name = std::make_shared<std::string>();
  command->add_option("name", *name, "Name of the mesh")->required();
  command->callback([name, &common, &exit_code] {
    exit_code = run_named<proto::AdminRemove>(common, "remove", *name, print_removed);
  });
}

void add_status(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("status", "Show how the daemon is");
  command->callback([&common, &exit_code] {
    exit_code = run(common, "status", proto::AdminStatus{},
                    [](const ordered_json& document) { print_lines(field_lines(document)); });
  });
}

}  // namespace pmcd::admin
