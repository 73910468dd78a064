// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the codec alone on one mesh: loads the file once, encodes, proves and decodes it in memory, and prints the
// figures as one JSON object, each time apart. Files, import and the error of levels are not in the times.
// bench/codec/run and growth make tables of it.
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/codec/process_memory.h"
#include "codec/decoder.h"
#include "codec/encoder.h"
#include "codec/import/file_io.h"
#include "codec/import/ingest_file.h"
#include "codec/import/memory.h"
#include "codec/import/read_mesh.h"
#include "codec/import/write_mesh.h"
#include "codec/lattice/lattice.h"
#include "codec/packet/directory.h"
#include "codec/proof.h"

namespace pmcd::bench {
namespace {

struct Arguments {
  std::string mesh;
  std::optional<unsigned> bits;
  std::optional<unsigned> levels;
  bool cleaning = false;
  std::string effort;
  bool errors = false;
  unsigned repeat = 3;
  std::string write_mesh;
  std::string write_expected;
  std::string write_packets;
};

/// A reason to give up, for stderr; empty means success.
using Failure = std::string;

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Runs `work` once and starts from nothing.
template <typename Work>
std::uint64_t peak_bytes(const Work& work) {
  const PeakMemory memory;
  const auto result = work();
  return memory.growth_bytes();
}

/// Of `repeat` runs, each of which starts from nothing.
template <typename Work>
double median_cpu_seconds(unsigned repeat, const Work& work) {
  std::vector<double> seconds(repeat);
  for (double& one : seconds) {
    const double start = cpu_seconds();
    const auto result = work();
    one = cpu_seconds() - start;
  }
  std::nth_element(seconds.begin(), seconds.begin() + repeat / 2, seconds.end());
  return seconds[repeat / 2];
}

codec::Result<codec::TriangleMesh> decode(const std::vector<codec::EncodedPacket>& packets) {
  codec::Decoder decoder;
  for (const codec::EncodedPacket& packet : packets) {
    const auto level = decoder.apply(packet.bytes);
    if (!level) return level.error();
  }
  return decoder.mesh();
}

/// The mesh that the last level has to be: every vertex on the lattice if there are bits, else the mesh itself.
codec::Result<codec::TriangleMesh> expected_mesh(const codec::TriangleMesh& mesh, const std::optional<unsigned>& bits) {
  codec::TriangleMesh expected = mesh;
  if (!bits) return expected;
  const auto lattice = codec::Lattice::over(mesh, *bits);
  if (!lattice) return lattice.error();
  for (codec::Position& position : expected.positions) position = lattice->position(lattice->snap(position));
  return expected;
}

/// The one place where --effort meets the library.
Failure set_effort(const std::string& effort, codec::EncodeOptions& options) {
  if (effort.empty() || effort == "default") return {};
  if (effort != "best") return "--effort: this encoder knows no effort " + effort;
  options.effort = codec::Effort::best;
  return {};
}

Failure write_mesh(const std::string& path, const codec::TriangleMesh& mesh) {
  const auto written = import::write_mesh(path, mesh);
  return written ? Failure() : import::to_line(written.error());
}

Failure write_files(const Arguments& arguments, const codec::TriangleMesh& mesh, const std::vector<std::byte>& file) {
  Failure failure;
  if (!arguments.write_mesh.empty()) failure = write_mesh(arguments.write_mesh, mesh);
  if (failure.empty() && !arguments.write_expected.empty()) {
    const auto expected = expected_mesh(mesh, arguments.bits);
    failure = expected ? write_mesh(arguments.write_expected, *expected) : expected.error().detail;
  }
  if (failure.empty() && !arguments.write_packets.empty()) {
    const auto refused = import::save_file(arguments.write_packets, file);
    if (refused) failure = import::to_line(*refused);
  }
  return failure;
}

nlohmann::json bits_per_vertex(const codec::Encoded& encoded, std::size_t vertices) {
  const codec::BitReport& bits = encoded.report.bits;
  double total = 0;
  for (const codec::EncodedPacket& packet : encoded.packets) total += 8.0 * static_cast<double>(packet.bytes.size());
  const double payload =
      bits.base + bits.connectivity + bits.geometry + bits.precision + bits.exactness + bits.isolated;
  const auto count = static_cast<double>(std::max<std::size_t>(vertices, 1));
  return {{"base", bits.base / count},
          {"connectivity", bits.connectivity / count},
          {"geometry", bits.geometry / count},
          {"precision", bits.precision / count},
          {"exactness", bits.exactness / count},
          {"isolated", bits.isolated / count},
          {"headers", (total - payload) / count},
          {"total", total / count}};
}

nlohmann::json level_list(const codec::Directory& directory) {
  const auto measured = [](double error) { return error < 0 ? nlohmann::json() : nlohmann::json(error); };
  nlohmann::json levels = nlohmann::json::array();
  for (const codec::LevelEntry& level : directory.levels) {
    levels.push_back({{"bytes", level.bytes},
                      {"vertices", level.vertices},
                      {"faces", level.faces},
                      {"error_rms", measured(level.error_rms)},
                      {"error_max", measured(level.error_max)}});
  }
  return levels;
}

Failure run(const Arguments& arguments) {
  auto imported = import::read_mesh(arguments.mesh);
  if (!imported) return import::to_line(imported.error());
  const codec::TriangleMesh mesh = std::move(imported->mesh);

  codec::EncodeOptions options;
  options.bits = arguments.bits;
  options.max_packets_after_base = arguments.levels;
  options.cleaning = arguments.cleaning;
  if (Failure failure = set_effort(arguments.effort, options); !failure.empty()) return failure;
  const auto encode = [&] { return codec::encode(mesh, options); };
  const auto encoded = encode();
  if (!encoded) return std::string(codec::error_name(encoded.error().code)) + ": " + encoded.error().detail;
  // As pmctool does, proof and errors included.
  import::IngestOptions ingest_options;
  ingest_options.measure_errors = arguments.errors;
  const auto ingested = import::ingest_encoded(*encoded, mesh, arguments.mesh, ingest_options);
  if (!ingested) return import::to_line(ingested.error());
  const std::vector<std::byte> file = import::to_file_bytes(*ingested);
  if (Failure failure = write_files(arguments, mesh, file); !failure.empty()) return failure;

  const auto prove = [&] { return codec::prove(*encoded, mesh); };
  const auto encode_and_prove = [&] {
    const auto again = encode();
    return codec::prove(*again, mesh);
  };
  const auto decode_all = [&] { return decode(encoded->packets); };
  const std::size_t mesh_bytes =
      mesh.positions.size() * sizeof(codec::Position) + mesh.faces.size() * sizeof(codec::Face);
  // Memory first: what the runs for the times leave behind in the heap would be in it.
  const std::uint64_t encoding_peak = peak_bytes(encode_and_prove) + mesh_bytes;
  const std::uint64_t decoding_peak = peak_bytes(decode_all);

  nlohmann::json json = {{"vertices", mesh.positions.size()},
                         {"faces", mesh.faces.size()},
                         {"components", encoded->report.components},
                         {"isolated_vertices", encoded->report.isolated_vertices},
                         {"boundary_edges", encoded->report.boundary_edges},
                         {"passes", encoded->report.passes},
                         {"encode_cpu_seconds", median_cpu_seconds(arguments.repeat, encode)},
                         {"prove_cpu_seconds", median_cpu_seconds(arguments.repeat, prove)},
                         {"decode_cpu_seconds", median_cpu_seconds(arguments.repeat, decode_all)},
                         {"encode_and_prove_peak_bytes", encoding_peak},
                         {"decode_peak_bytes", decoding_peak},
                         {"bits_per_vertex", bits_per_vertex(*encoded, mesh.positions.size())},
                         {"file_bytes", file.size()},
                         {"levels", level_list(ingested->directory)}};
  json["bits"] = arguments.bits ? nlohmann::json(*arguments.bits) : nlohmann::json();
  std::cout << json.dump(1) << '\n';
  return {};
}

}  // namespace
}  // namespace pmcd::bench

int main(int argc, char** argv) try {
  pmcd::import::return_large_blocks();  // as pmctool does
  pmcd::bench::Arguments arguments;
  CLI::App app("Encodes, proves and decodes one mesh in memory and prints what it took, as JSON.");
  app.add_option("mesh", arguments.mesh, "PLY, OBJ, OFF or STL file")->required();
  app.add_option("--bits", arguments.bits, "bits of the lattice; without it lossless")->check(CLI::Range(4, 24));
  app.add_option("--levels", arguments.levels, "at most this many packets after the base");
  app.add_flag("--cleaning", arguments.cleaning, "with cleaning conquests");
  app.add_option("--effort", arguments.effort, "how hard to try: default or best");
  app.add_flag("--errors", arguments.errors, "measure the error of each level, untimed");
  app.add_option("--repeat", arguments.repeat, "timings of which the median is taken")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--write-mesh", arguments.write_mesh, "write the mesh as it was imported");
  app.add_option("--write-expected", arguments.write_expected, "write the mesh that the last level has to be");
  app.add_option("--write-packets", arguments.write_packets, "write the packets as a .pmcd file");
  CLI11_PARSE(app, argc, argv);

  const std::string failure = pmcd::bench::run(arguments);
  if (failure.empty()) return 0;
  std::cerr << "codec_bench: " << failure << '\n';
  return 1;
} catch (const std::exception& error) {
  std::cerr << "codec_bench: " << error.what() << '\n';
  return 1;
}
