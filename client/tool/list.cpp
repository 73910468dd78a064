// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool list: the meshes of a server as a table or as JSON.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/session.h"
#include "client/tool/commands.h"
#include "proto/text.h"

namespace pmcd::tool {

namespace {

struct ListOptions {
  std::string server;
  std::string filter;
  bool json = false;
};

/// Characters of a UTF-8 text, which is what a column is wide (wide characters apart).
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

void print_json(const std::vector<proto::MeshListEntry>& meshes) {
  nlohmann::ordered_json document;
  document["meshes"] = nlohmann::ordered_json::array();
  for (const proto::MeshListEntry& mesh : meshes) {
    document["meshes"].push_back({{"name", mesh.name},
                                  {"generation", hex(mesh.generation)},
                                  {"vertices", mesh.vertices},
                                  {"faces", mesh.faces},
                                  {"packets", mesh.levels},
                                  {"bytes", mesh.bytes},
                                  {"lossless", mesh.lossless},
                                  {"bits", mesh.bits},
                                  {"scalar", mesh.float64 ? "float64" : "float32"},
                                  {"format_version", mesh.format_version},
                                  {"box_min", mesh.box_min},
                                  {"box_max", mesh.box_max}});
  }
  std::cout << document.dump(2) << '\n';
}

void print_table(const std::vector<proto::MeshListEntry>& meshes) {
  std::vector<std::vector<std::string>> rows{{"name", "vertices", "faces", "levels", "bytes"}};
  for (const proto::MeshListEntry& mesh : meshes) {
    rows.push_back({mesh.name, std::to_string(mesh.vertices), std::to_string(mesh.faces), std::to_string(mesh.levels),
                    std::to_string(mesh.bytes)});
  }
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  }
  for (const auto& row : rows) {
    std::string line = row[0] + std::string(widths[0] - width_of(row[0]), ' ');
    for (std::size_t i = 1; i < row.size(); ++i) line += "  " + std::string(widths[i] - row[i].size(), ' ') + row[i];
    std::cout << line << '\n';
  }
}

int run(const ListOptions& options) {
  const auto address = client::parse_address(options.server);
  if (!address) {
    std::cerr << "pmctool list: " << address.error().text << '\n';
    return kExitUsage;
  }
  client::Options session_options;
  session_options.agent = "pmctool list";
  auto session = client::Session::connect(*address, session_options);
  const auto meshes =
      session ? session->list(options.filter) : client::Result<std::vector<proto::MeshListEntry>>(session.error());
  if (!meshes) {
    std::cerr << "pmctool list: " << meshes.error().text << '\n';
    return kExitRefused;
  }
  if (options.json) {
    print_json(*meshes);
  } else {
    print_table(*meshes);
  }
  return kExitDone;
}

}  // namespace

void add_list(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("list", "Show the meshes of a server");
  const auto options = std::make_shared<ListOptions>();
  command->add_option("server", options->server, "HOST[:PORT]; an IPv6 address in brackets")->required();
  command
      ->add_option("--filter", options->filter,
                   "Only meshes whose names contain this; upper and lower case of A to Z are the same")
      ->check(CLI::Validator(
          [](const std::string& text) {
            return text.size() <= proto::kMaxNameBytes ? "" : "no name is longer than 128 bytes";
          },
          ""))
      ->type_name("TEXT");
  command->add_flag("--json", options->json, "Print JSON");
  command->footer("\nExamples:\n  pmctool list localhost\n  pmctool list --filter bunny --json [::1]:7621\n");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pmcd::tool
