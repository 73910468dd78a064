// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool compare: are two files the same mesh up to numbering? If not, where they differ and how far they are apart.
#include "codec/import/compare.h"

#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "client/tool/commands.h"
#include "client/tool/offline.h"
#include "codec/import/measure.h"

namespace pmcd::tool {
namespace {

struct CompareCommand {
  std::string a;
  std::string b;
  bool as_double = false;
  bool json = false;
};

/// What import changed about a file counts for the answer, so it is told.
void print_repairs(const std::string& file, const import::ImportReport& report) {
  const std::vector<std::string> lines = report.lines();
  for (std::size_t i = 1; i < lines.size(); ++i) std::cout << file << ": " << lines[i] << '\n';
}

void print_distance(const char* from, const char* to, const import::Distance& d) {
  std::cout << "distance from " << from << " to " << to << ": rms " << error_figure(d.rms) << ", max "
            << error_figure(d.max) << " of " << from << "'s diagonal\n";
}

nlohmann::ordered_json as_json(const import::Distance& d) {
  const auto number = [](double x) {
    return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json(nullptr);
  };
  return {{"rms", number(d.rms)}, {"max", number(d.max)}};
}

int run(const CompareCommand& command) {
  const import::ImportOptions options{false, command.as_double};
  const auto a = load_mesh(command.a, options);
  if (!a) return complain("compare", a.error());
  const auto b = load_mesh(command.b, options);
  if (!b) return complain("compare", b.error());
  const import::Comparison comparison = import::compare_meshes(a->mesh, b->mesh, "A", "B");
  import::Distance a_to_b;
  import::Distance b_to_a;
  if (!comparison.same) {
    a_to_b = import::ErrorMeter(a->mesh).distance_to(b->mesh);
    b_to_a = import::ErrorMeter(b->mesh).distance_to(a->mesh);
  }
  if (command.json) {
    nlohmann::ordered_json document{{"a", command.a}, {"b", command.b}, {"same", comparison.same}};
    document["differences"] = comparison.differences;
    document["distance"] = {{"a_to_b", as_json(a_to_b)}, {"b_to_a", as_json(b_to_a)}};
    std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    return comparison.same ? kExitDone : kExitNo;
  }
  print_repairs(command.a, a->report);
  print_repairs(command.b, b->report);
  if (comparison.same) {
    std::cout << "same: " << a->mesh.positions.size() << " vertices, " << a->mesh.faces.size()
              << " faces, equal up to numbering\n";
    return kExitDone;
  }
  std::cout << "not the same mesh (A is " << command.a << ", B is " << command.b << "):\n";
  for (const std::string& line : comparison.differences) std::cout << "  " << line << '\n';
  print_distance("A", "B", a_to_b);
  print_distance("B", "A", b_to_a);
  return kExitNo;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("compare", "Tell whether two files hold the same mesh up to numbering");
  const auto options = std::make_shared<CompareCommand>();
  command->add_option("a", options->a, "A mesh file or a .pmcd file, which is decoded whole")->required();
  command->add_option("b", options->b, "Another")->required();
  command->add_flag("--double", options->as_double, "Take text coordinates as double instead of float32");
  command->add_flag("--json", options->json, "Print the answer as JSON");
  command->footer(
      "\nThe same means: a bijection of the vertices keeps every position's bits and maps faces onto faces.\n"
      "Ends with 0 if they are the same, 1 if not.\n\nExample:\n  pmctool compare bunny.ply bunny.pmcd\n");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pmcd::tool
