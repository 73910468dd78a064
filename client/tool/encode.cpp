// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool encode: a mesh file becomes a .pmcd file.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/tool/commands.h"
#include "client/tool/offline.h"
#include "codec/import/file_io.h"
#include "codec/import/ingest_file.h"

namespace pmcd::tool {
namespace {

struct EncodeCommand {
  std::string in;
  std::string out;
  std::optional<unsigned> bits;
  std::optional<unsigned> levels;
  std::string effort = "default";
  bool cleaning = false;
  double flip_limit = codec::EncodeOptions{}.min_flip_cosine;
  std::optional<double> shape_limit;
  bool strict = false;
  bool as_double = false;
  bool json = false;
  bool no_errors = false;
};

/// One line on stderr that is overwritten as work goes on, if anybody looks at it.
class ProgressLine {
 public:
  ProgressLine() : shown_(::isatty(STDERR_FILENO) == 1) {}
  ~ProgressLine() {
    if (any_) std::fputs("\r\x1b[K", stderr);
  }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(import::IngestStage stage, double fraction) {
    if (!shown_) return;
    std::fprintf(stderr, "\r\x1b[K%s %3.0f %%", import::stage_name(stage), 100 * fraction);
    std::fflush(stderr);
    any_ = true;
  }

 private:
  bool shown_;
  bool any_ = false;
};

/// Some of the file's bits, and what they are for.
struct Part {
  const char* key;   ///< in JSON
  const char* name;  ///< for people
  double bits;
};

/// What the figures are made of.
struct Figures {
  double vertices = 0;
  double raw_bytes = 0;  ///< plain arrays: three coordinates a vertex, three 32-bit indices a face
  double file_bits = 0;
  std::vector<Part> parts;  ///< they sum up to the file

  Figures(const import::Ingested& ingested, std::uint64_t file_bytes) {
    const import::ImportReport& import = ingested.import_report;
    const codec::BitReport& bits = ingested.encode_report.bits;
    vertices = static_cast<double>(import.vertices);
    raw_bytes = vertices * (import.float64 ? 24 : 12) + static_cast<double>(import.faces) * 12;
    file_bits = static_cast<double>(file_bytes) * 8;
    parts = {{"base", "base mesh", bits.base},           {"connectivity", "connectivity", bits.connectivity},
             {"geometry", "geometry", bits.geometry},    {"precision", "precision", bits.precision},
             {"exactness", "exactness", bits.exactness}, {"isolated", "isolated vertices", bits.isolated}};
    double headers = file_bits;
    for (const Part& part : parts) headers -= part.bits;
    parts.push_back({"headers", "headers and directory", headers});
  }
  [[nodiscard]] double per_vertex(double bits) const { return vertices > 0 ? bits / vertices : 0; }
};

void print_parts(const Figures& figures) {
  std::vector<std::vector<std::string>> rows{{"where the bits went", "bytes", "bits per vertex", "share"}};
  const auto add = [&](const char* name, double bits) {
    rows.push_back({name, fixed(bits / 8, 0), fixed(figures.per_vertex(bits), 2),
                    fixed(figures.file_bits > 0 ? 100 * bits / figures.file_bits : 0, 1) + " %"});
  };
  for (const Part& part : figures.parts) add(part.name, part.bits);
  add("file", figures.file_bits);
  print_table(rows, FirstColumn::names, "  ");
}

void print_text(const EncodeCommand& command, const import::Ingested& done, std::uint64_t file_bytes) {
  const std::vector<std::string> lines = done.import_report.lines();
  for (std::size_t i = 0; i < lines.size(); ++i) std::cout << (i == 0 ? command.in + ": " : "  ") << lines[i] << '\n';
  const Figures figures(done, file_bytes);
  std::cout << command.out << ": " << file_bytes << " bytes, "
            << (done.directory.lossless ? "lossless"
                                        : std::to_string(done.directory.lattice.bits) + " bits a coordinate")
            << ", " << done.packets.size() << " packets; the base mesh has " << done.packets.front().vertices
            << " vertices in " << done.packets.front().bytes.size() << " bytes\n";
  print_parts(figures);
  if (figures.raw_bytes > 0) {
    const double share = static_cast<double>(file_bytes) / figures.raw_bytes;
    std::cout << "  " << fixed(100 * share, 1) << " % of plain arrays, "
              << (done.import_report.float64 ? "float64" : "float32") << " positions and 32-bit indices ("
              << fixed(figures.raw_bytes, 0) << " bytes)";
    if (share < 1) std::cout << ": " << fixed(1 / share, 1) << " times smaller";
    std::cout << '\n';
  }
  std::cout << "  encoded in " << fixed(done.encode_seconds, 2) << " s";
  if (done.encode_seconds > 0) {
    std::cout << " (" << fixed(figures.vertices / done.encode_seconds, 0) << " vertices a second)";
  }
  std::cout << ", proven by decoding in " << fixed(done.prove_seconds, 2) << " s";
  if (!command.no_errors) std::cout << ", errors measured in " << fixed(done.measure_seconds, 2) << " s";
  std::cout << '\n';
}

void print_json(const EncodeCommand& command, const import::Ingested& done, std::uint64_t file_bytes) {
  const import::ImportReport& import = done.import_report;
  const codec::EncodeReport& report = done.encode_report;
  const Figures figures(done, file_bytes);
  nlohmann::ordered_json bits_per_vertex{{"total", figures.per_vertex(figures.file_bits)}};
  for (const Part& part : figures.parts) bits_per_vertex[part.key] = figures.per_vertex(part.bits);
  nlohmann::ordered_json document{{"in", command.in},
                                  {"out", command.out},
                                  {"import",
                                   {{"format", import.format},
                                    {"scalar", import.float64 ? "float64" : "float32"},
                                    {"vertices", import.vertices},
                                    {"faces", import.faces},
                                    {"corners_welded", import.corners_welded},
                                    {"polygons_triangulated", import.polygons_triangulated},
                                    {"diagonals_avoided", import.diagonals_avoided},
                                    {"polygons_not_simple", import.polygons_not_simple},
                                    {"faces_turned", import.faces_turned},
                                    {"isolated_vertices", import.isolated_vertices},
                                    {"zero_area_faces", import.zero_area_faces},
                                    {"left_out", import.left_out}}},
                                  {"generation", hex(done.directory.generation)},
                                  {"lossless", done.directory.lossless},
                                  {"bytes", file_bytes},
                                  {"raw_bytes", figures.raw_bytes},
                                  {"packets", done.packets.size()},
                                  {"base_vertices", done.packets.front().vertices},
                                  {"base_bytes", done.packets.front().bytes.size()},
                                  {"components", report.components},
                                  {"passes", report.passes},
                                  {"bits_per_vertex", bits_per_vertex},
                                  {"seconds",
                                   {{"read", done.read_seconds},
                                    {"encode", done.encode_seconds},
                                    {"prove", done.prove_seconds},
                                    {"measure", done.measure_seconds}}}};
  std::cout << document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

int run(const EncodeCommand& command) {
  const std::string extension = import::extension_of(command.out);
  for (const char* mesh : {"ply", "obj", "off", "stl"}) {
    if (extension != mesh) continue;
    std::cerr << "pmctool encode: " << command.out
              << ": encode writes packets, name them something.pmcd (decode writes ." << mesh << " files)\n";
    return kExitUsage;
  }
  import::IngestOptions options;
  options.import = {command.strict, command.as_double};
  options.encode.effort = command.effort == "best" ? codec::Effort::best : codec::Effort::standard;
  options.encode.bits = command.bits;
  options.encode.max_packets_after_base = command.levels;
  options.encode.cleaning = command.cleaning;
  options.encode.min_flip_cosine = command.flip_limit;
  options.encode.max_shape_error = command.shape_limit;
  options.measure_errors = !command.no_errors;
  const auto ingested = [&] {
    ProgressLine line;
    options.progress = [&line](import::IngestStage stage, double fraction) {
      line.show(stage, fraction);
      return true;
    };
    return import::ingest_file(command.in, options);
  }();
  if (!ingested) return complain("encode", ingested.error());
  const std::vector<std::byte> bytes = import::to_file_bytes(*ingested);
  if (const auto failure = import::save_file(command.out, bytes)) return complain("encode", *failure);
  command.json ? print_json(command, *ingested, bytes.size()) : print_text(command, *ingested, bytes.size());
  return kExitDone;
}

}  // namespace

void add_encode(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("encode", "Compress a mesh file into progressive packets");
  const auto options = std::make_shared<EncodeCommand>();
  command->add_option("in", options->in, "Mesh to read: .ply, .obj, .off or .stl")->required();
  command->add_option("out", options->out, "File to write, something.pmcd")->required();
  command->add_option("--bits", options->bits, "Snap positions to a lattice of 2^N steps (4 to 24); default: lossless")
      ->check(CLI::Range(4, 24))
      ->type_name("N");
  command->add_option("--levels", options->levels, "At most N packets after the base mesh (1 to 1000)")
      ->check(CLI::Range(1, 1000))
      ->type_name("N");
  command->add_option("--effort", options->effort, "How hard to try; best: smaller, slower to write and to read")
      ->check(CLI::IsMember({"default", "best"}))
      ->capture_default_str()
      ->type_name("NAME");
  command->add_flag("--cleaning", options->cleaning, "Follow each pass by a cleaning pass, as in the paper");
  command->add_option("--flip-limit", options->flip_limit, "Least cosine between new and old normals, -1 to 1")
      ->check(CLI::Range(-1.0, 1.0))
      ->capture_default_str()
      ->type_name("COS");
  command
      ->add_option("--shape-limit", options->shape_limit, "Most a removal may change the shape, in mean edge lengths")
      ->check(CLI::NonNegativeNumber)
      ->type_name("X");
  command->add_flag("--strict", options->strict,
                    "Refuse a file with colours, normals or others that would be left out");
  command->add_flag("--double", options->as_double, "Take text coordinates as double instead of float32");
  command->add_flag("--no-errors", options->no_errors, "Do not measure the error of each level (quicker)");
  command->add_flag("--json", options->json, "Print the result as JSON");
  command->footer(
      "\nExamples:\n  pmctool encode bunny.ply bunny.pmcd\n  pmctool encode --bits 12 part.stl part.pmcd\n");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pmcd::tool
