// SPDX-License-Identifier: GPL-3.0-or-later
// The commands that ask the daemon for a JSON document and print it: list, show, remove, status.
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>
#include <vector>

#include "admin-cli/admin_line.h"
#include "admin-cli/commands.h"
#include "proto/admin.h"
#include "proto/text.h"

namespace pmcd::admin {

namespace {

using nlohmann::ordered_json;

constexpr std::chrono::milliseconds kAnswerPatience{60'000};
constexpr std::size_t kMaxAnswerBytes = std::size_t{256} << 20;
constexpr std::uint32_t kId = 1;

/// Sends one request and gathers its answer.
std::variant<ordered_json, Failure> ask(const std::string& socket, const proto::Bytes& request) {
  auto opened = AdminLine::open(socket);
  if (auto* failed = std::get_if<Failure>(&opened)) return std::move(*failed);
  auto& line = std::get<AdminLine>(opened);
  if (auto failed = line.send(request)) return *failed;
  std::string text;
  for (bool last = false; !last;) {
    auto answer = line.receive(kAnswerPatience);
    if (auto* failed = std::get_if<Failure>(&answer)) return std::move(*failed);
    auto piece = read_as<proto::AdminAnswer>(std::get<Answer>(answer));
    if (auto* failed = std::get_if<Failure>(&piece)) return std::move(*failed);
    text += std::get<proto::AdminAnswer>(piece).text;
    last = std::get<proto::AdminAnswer>(piece).last;
    if (text.size() > kMaxAnswerBytes) {
      return Failure{kRefused, proto::ErrorCode::none, "the daemon's answer does not end"};
    }
  }
  auto document = ordered_json::parse(text, nullptr, false);
  if (!document.is_object()) {
    return Failure{kRefused, proto::ErrorCode::none, "the daemon's answer is not a JSON object"};
  }
  return document;
}

/// A field as a person reads it: text without quotes, everything else as JSON, "-" when it is missing.
std::string field(const ordered_json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return "-";
  if (found->is_string()) return proto::printable(found->get<std::string>(), 4096);
  if (found->is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", found->get<double>());
    return text;
  }
  return found->dump();
}

std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

/// A table with a head line; the first column stands left, the others right.
void print_table(const ordered_json& rows, const std::vector<const char*>& columns) {
  std::vector<std::vector<std::string>> lines(1);
  for (const char* column : columns) lines.front().emplace_back(column);
  for (const ordered_json& row : rows) {
    std::vector<std::string> line;
    line.reserve(columns.size());
    for (const char* column : columns) line.push_back(field(row, column));
    lines.push_back(std::move(line));
  }
  std::vector<std::size_t> widths(columns.size(), 0);
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], width_of(line[i]));
  }
  for (const auto& line : lines) {
    std::string text = line[0] + std::string(widths[0] - width_of(line[0]), ' ');
    for (std::size_t i = 1; i < line.size(); ++i)
      text += "  " + std::string(widths[i] - width_of(line[i]), ' ') + line[i];
    std::cout << text << '\n';
  }
}

void print_fields(const ordered_json& object) {
  std::size_t width = 0;
  for (const auto& item : object.items()) width = std::max(width, item.key().size());
  for (const auto& item : object.items()) {
    if (item.key() == "levels") continue;
    std::cout << item.key() << std::string(width - item.key().size() + 2, ' ') << field(object, item.key().c_str())
              << '\n';
  }
}

ordered_json rows_of(const ordered_json& document, const char* name) {
  const auto found = document.find(name);
  if (found == document.end() || !found->is_array()) return ordered_json::array();
  ordered_json rows = ordered_json::array();
  for (const ordered_json& row : *found) {
    if (row.is_object()) rows.push_back(row);
  }
  return rows;
}

using Print = void (*)(const ordered_json& document);

int run(const Common& common, const std::string& command, const proto::Bytes& request, Print print) {
  const auto answer = ask(common.socket, request);
  if (const auto* failed = std::get_if<Failure>(&answer)) return report(common, command, *failed);
  const auto& document = std::get<ordered_json>(answer);
  if (common.json) {
    std::cout << document.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  } else {
    print(document);
  }
  return kDone;
}

/// Asks about a name; a name that cannot be one is refused here.
int run_named(const Common& common, const std::string& command, const std::string& name, const proto::Bytes& request,
              Print print) {
  if (!proto::is_mesh_name(name)) {
    return report(common, command,
                  {kUsage, proto::ErrorCode::bad_name,
                   "this is no name of a mesh: 1 to 128 bytes of printable UTF-8 without a slash"});
  }
  return run(common, command, request, print);
}

}  // namespace

void add_list(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("list", "Show the meshes that are stored");
  command->callback([&common, &exit_code] {
    exit_code = run(common, "list", proto::encode(proto::AdminList{kId}), [](const ordered_json& document) {
      print_table(rows_of(document, "meshes"), {"name", "vertices", "faces", "packets", "bytes", "generation"});
      for (const ordered_json& mesh : rows_of(document, "damaged")) {
        std::cerr << "pmcctl list: mesh \"" << field(mesh, "name") << "\" is damaged: " << field(mesh, "error")
                  << "; ingest it again with --replace, or remove it\n";
      }
    });
  });
}

void add_show(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("show", "Show one mesh and its levels");
  const auto name = std::make_shared<std::string>();
  command->add_option("name", *name, "Name of the mesh")->required();
  command->callback([name, &common, &exit_code] {
    exit_code =
        run_named(common, "show", *name, proto::encode(proto::AdminShow{kId, *name}), [](const ordered_json& document) {
          print_fields(document);
          std::cout << '\n';
          print_table(rows_of(document, "levels"),
                      {"level", "bytes", "vertices", "faces", "bits", "error_rms", "error_max"});
        });
  });
}

void add_remove(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("remove", "Remove a mesh");
  const auto name = std::make_shared<std::string>();
  command->add_option("name", *name, "Name of the mesh")->required();
  command->callback([name, &common, &exit_code] {
    exit_code = run_named(common, "remove", *name, proto::encode(proto::AdminRemove{kId, *name}),
                          [](const ordered_json& document) {
                            std::cout << "removed " << field(document, "removed") << " (generation "
                                      << field(document, "generation") << ")\n";
                          });
  });
}

void add_status(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* command = app.add_subcommand("status", "Show how the daemon is");
  command->callback([&common, &exit_code] {
    exit_code = run(common, "status", proto::encode(proto::AdminStatus{kId}), print_fields);
  });
}

}  // namespace pmcd::admin
