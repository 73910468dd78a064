// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool info: what a .pmcd file holds, level by level, or what import makes of a mesh file. Decodes nothing; the
// errors of levels are those that were measured at encoding and stand in the directory.
#include <cstdint>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/tool/commands.h"
#include "client/tool/offline.h"
#include "codec/import/file_io.h"
#include "codec/import/ingest_file.h"
#include "codec/import/read_mesh.h"
#include "codec/packet/directory.h"

namespace pmcd::tool {
namespace {

struct InfoCommand {
  std::string file;
  bool levels = false;
  bool json = false;
};

using Json = nlohmann::ordered_json;

void print(const Json& document) {
  std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

const char* scalar_name(bool float64) {
  return float64 ? "float64" : "float32";
}

Json levels_json(const codec::Directory& d) {
  const auto measured = [](double error) { return error < 0 ? Json(nullptr) : Json(error); };
  Json levels = Json::array();
  std::uint64_t so_far = 0;
  for (std::size_t k = 0; k < d.levels.size(); ++k) {
    const codec::LevelEntry& level = d.levels[k];
    so_far += level.bytes;
    levels.push_back({{"level", k},
                      {"bytes", level.bytes},
                      {"bytes_so_far", so_far},
                      {"vertices", level.vertices},
                      {"faces", level.faces},
                      {"bits", level.bits},
                      {"error_rms", measured(level.error_rms)},
                      {"error_max", measured(level.error_max)}});
  }
  return levels;
}

void print_directory_json(const std::string& file, std::uint64_t bytes, const codec::Directory& d) {
  print({{"file", file},
         {"bytes", bytes},
         {"format_version", d.format_version},
         {"generation", hex(d.generation)},
         {"lossless", d.lossless},
         {"vertices", d.levels.empty() ? 0 : d.levels.back().vertices},
         {"faces", d.levels.empty() ? 0 : d.levels.back().faces},
         {"lattice",
          {{"scalar", scalar_name(d.lattice.scalar == codec::Scalar::float64)},
           {"bits", d.lattice.bits},
           {"min", d.lattice.min},
           {"step", d.lattice.step}}},
         {"box_min", d.box_min},
         {"box_max", d.box_max},
         {"levels", levels_json(d)}});
}

void print_levels(const codec::Directory& d) {
  std::vector<std::vector<std::string>> rows{
      {"level", "bytes", "so far", "vertices", "faces", "bits", "rms error", "max error"}};
  std::uint64_t so_far = 0;
  for (std::size_t k = 0; k < d.levels.size(); ++k) {
    const codec::LevelEntry& level = d.levels[k];
    so_far += level.bytes;
    rows.push_back({std::to_string(k), std::to_string(level.bytes), std::to_string(so_far),
                    std::to_string(level.vertices), std::to_string(level.faces), std::to_string(level.bits),
                    error_figure(level.error_rms), error_figure(level.error_max)});
  }
  print_table(rows, FirstColumn::numbers, "");
}

void print_directory(const std::string& file, std::uint64_t bytes, const codec::Directory& d) {
  const codec::LevelEntry last = d.levels.empty() ? codec::LevelEntry{} : d.levels.back();
  std::cout << file << ": " << last.vertices << " vertices, " << last.faces << " faces, " << bytes << " bytes, "
            << (d.lossless ? "lossless" : "snapped to the lattice") << ", format version "
            << static_cast<unsigned>(d.format_version) << ", generation " << hex(d.generation) << '\n';
  std::cout << "lattice: " << d.lattice.bits << " bits, step " << d.lattice.step << ", coordinates as "
            << scalar_name(d.lattice.scalar == codec::Scalar::float64) << '\n';
  print_levels(d);
  std::cout << "Errors are relative to the diagonal of the bounding box; - means not measured.\n";
}

int packet_file_info(const InfoCommand& command) {
  const auto bytes = import::load_file(command.file);
  if (!bytes) return complain("info", bytes.error());
  const codec::Result<codec::ParsedFile> parsed = codec::parse_file(*bytes);
  if (!parsed) {
    return complain("info", import::from_codec(parsed.error(), import::ImportErrorCode::bad_packet_file, command.file));
  }
  const codec::Directory& directory = parsed->directory;
  if (command.levels) {
    command.json ? print(levels_json(directory)) : print_levels(directory);
  } else {
    command.json ? print_directory_json(command.file, bytes->size(), directory)
                 : print_directory(command.file, bytes->size(), directory);
  }
  return kExitDone;
}

int mesh_file_info(const InfoCommand& command) {
  if (command.levels) {
    std::cerr << "pmctool info: " << command.file << ": --levels is for .pmcd files; encode the mesh first\n";
    return kExitUsage;
  }
  const auto mesh = import::read_mesh(command.file);
  if (!mesh) return complain("info", mesh.error());
  const import::ImportReport& report = mesh->report;
  if (command.json) {
    print({{"file", command.file},
           {"format", report.format},
           {"scalar", scalar_name(report.float64)},
           {"vertices", report.vertices},
           {"faces", report.faces},
           {"corners_welded", report.corners_welded},
           {"polygons_triangulated", report.polygons_triangulated},
           {"faces_turned", report.faces_turned},
           {"isolated_vertices", report.isolated_vertices},
           {"zero_area_faces", report.zero_area_faces},
           {"left_out", report.left_out}});
    return kExitDone;
  }
  const std::vector<std::string> lines = report.lines();
  for (std::size_t i = 0; i < lines.size(); ++i) std::cout << (i == 0 ? command.file + ": " : "  ") << lines[i] << '\n';
  return kExitDone;
}

}  // namespace

void add_info(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("info", "Show what a .pmcd file holds, or what a mesh file brings");
  const auto options = std::make_shared<InfoCommand>();
  command->add_option("file", options->file, "A .pmcd file, or a mesh: .ply, .obj, .off, .stl")->required();
  command->add_flag("--levels", options->levels, "Only the levels of a .pmcd file, a line each");
  command->add_flag("--json", options->json, "Print JSON");
  command->footer(
      "\nExamples:\n  pmctool info bunny.pmcd\n  pmctool info --levels bunny.pmcd\n  pmctool info --json bunny.pmcd\n");
  command->callback([options, &exit_code] {
    exit_code = is_packet_file(options->file) ? packet_file_info(*options) : mesh_file_info(*options);
  });
}

}  // namespace pmcd::tool
