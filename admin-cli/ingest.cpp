// SPDX-License-Identifier: GPL-3.0-or-later
// pmcctl ingest: encodes mesh files here, in this process, and hands the packets to the daemon. A .pmcd file is handed
// over as it is.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "admin-cli/admin_line.h"
#include "admin-cli/commands.h"
#include "admin-cli/progress_bar.h"
#include "admin-cli/upload.h"
#include "codec/import/file_io.h"
#include "codec/import/ingest_file.h"
#include "codec/packet/directory.h"
#include "proto/text.h"

namespace pmcd::admin {

namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

struct IngestCommand {
  std::vector<std::string> files;
  std::string name;
  std::optional<unsigned> bits;
  std::optional<unsigned> levels;
  std::string effort = "default";
  bool cleaning = false;
  bool strict = false;
  bool replace = false;
};

/// A mesh ready to be sent; the bytes of its packets live in `storage` or in `encoded`.
struct Prepared {
  codec::Directory directory;
  proto::Bytes directory_bytes;
  std::vector<std::span<const std::byte>> packets;
  std::vector<std::byte> storage;
  std::vector<codec::EncodedPacket> encoded;
  std::vector<std::string> notes;
  double encode_seconds = 0;  ///< 0, like the other two, for a .pmcd file
  double prove_seconds = 0;
  double measure_seconds = 0;
};

Failure bad_input(std::string text) {
  return {kBadInput, proto::ErrorCode::none, std::move(text)};
}

std::variant<Prepared, Failure> load_packets(const std::string& path) {
  auto bytes = import::load_file(path);
  if (!bytes) return bad_input(import::to_line(bytes.error()));
  Prepared prepared;
  prepared.storage = std::move(*bytes);
  auto file = codec::parse_file(prepared.storage);
  if (!file) {
    return bad_input(path + ": " + file.error().detail + " [" + codec::error_name(file.error().code) + "]");
  }
  prepared.directory = std::move(file->directory);
  prepared.directory_bytes = codec::serialize(prepared.directory);
  prepared.packets = std::move(file->packets);
  return prepared;
}

std::variant<Prepared, Failure> encode_file(const std::string& path, const IngestCommand& command, ProgressBar& bar) {
  import::IngestOptions options;
  options.import.strict = command.strict;
  options.encode.effort = command.effort == "best" ? codec::Effort::best : codec::Effort::standard;
  options.encode.bits = command.bits;
  options.encode.max_packets_after_base = command.levels;
  options.encode.cleaning = command.cleaning;
  options.progress = [&bar](import::IngestStage stage, double fraction) {
    bar.show(import::stage_name(stage), fraction);
    return true;
  };
  auto ingested = import::ingest_file(path, options);
  if (!ingested) {
    const bool usage = ingested.error().code == import::ImportErrorCode::invalid_option;
    return Failure{usage ? kUsage : kBadInput, proto::ErrorCode::none, import::to_line(ingested.error())};
  }
  Prepared prepared;
  prepared.directory = std::move(ingested->directory);
  prepared.directory_bytes = codec::serialize(prepared.directory);
  prepared.encoded = std::move(ingested->packets);
  for (const codec::EncodedPacket& packet : prepared.encoded) prepared.packets.emplace_back(packet.bytes);
  prepared.notes = ingested->import_report.lines();
  prepared.encode_seconds = ingested->encode_seconds;
  prepared.prove_seconds = ingested->prove_seconds;
  prepared.measure_seconds = ingested->measure_seconds;
  return prepared;
}

/// Whether the name can be taken, asked before minutes are spent on encoding.
std::optional<Failure> check_name(const std::string& socket, const std::string& name, bool replace) {
  auto opened = AdminLine::open(socket);
  if (auto* failed = std::get_if<Failure>(&opened)) return std::move(*failed);
  if (replace) return std::nullopt;
  auto& line = std::get<AdminLine>(opened);
  if (auto failed = line.send(proto::encode(proto::AdminShow{1, name}))) return failed;
  auto answer = line.receive(std::chrono::seconds(60));
  if (auto* failed = std::get_if<Failure>(&answer)) {
    return failed->code == proto::ErrorCode::unknown_mesh ? std::nullopt : std::optional(std::move(*failed));
  }
  return Failure{kRefused, proto::ErrorCode::mesh_exists,
                 "a mesh named \"" + name + "\" is stored already: use --replace, or --name for another name"};
}

std::variant<ordered_json, Failure> ingest(const Common& common, const IngestCommand& command,
                                           const std::string& path) {
  const auto start = Clock::now();
  const std::string name = command.name.empty() ? std::filesystem::path(path).stem().string() : command.name;
  if (!proto::is_mesh_name(name)) {
    return Failure{kUsage, proto::ErrorCode::bad_name,
                   path +
                       ": its name cannot be the name of a mesh (1 to 128 bytes of printable UTF-8 without a slash); "
                       "give one with --name"};
  }
  if (auto failed = check_name(common.socket, name, command.replace)) return *failed;

  ProgressBar bar(name, !common.json);
  const bool packed = import::extension_of(path) == "pmcd";
  auto made = packed ? load_packets(path) : encode_file(path, command, bar);
  if (auto* failed = std::get_if<Failure>(&made)) return std::move(*failed);
  const auto& prepared = std::get<Prepared>(made);

  auto opened = AdminLine::open(common.socket);
  if (auto* failed = std::get_if<Failure>(&opened)) return std::move(*failed);
  auto sent = upload(std::get<AdminLine>(opened), name, command.replace, prepared.directory_bytes, prepared.packets,
                     [&bar](double fraction) { bar.show("sending", fraction); });
  if (auto* failed = std::get_if<Failure>(&sent)) return std::move(*failed);
  bar.clear();

  std::uint64_t bytes = 0;
  for (const auto& packet : prepared.packets) bytes += packet.size();
  const codec::LevelEntry& last = prepared.directory.levels.back();
  char generation[17];
  std::snprintf(generation, sizeof generation, "%016llx",
                static_cast<unsigned long long>(std::get<proto::IngestOk>(sent).generation));
  ordered_json done;
  done["file"] = path;
  done["name"] = name;
  done["generation"] = generation;
  done["packets"] = prepared.packets.size();
  done["vertices"] = last.vertices;
  done["faces"] = last.faces;
  done["bytes"] = bytes;
  done["bits_per_vertex"] =
      last.vertices == 0 ? ordered_json(nullptr) : ordered_json(8.0 * static_cast<double>(bytes) / last.vertices);
  done["seconds"] = std::chrono::duration<double>(Clock::now() - start).count();
  done["encode_seconds"] = prepared.encode_seconds;
  done["prove_seconds"] = prepared.prove_seconds;
  done["measure_seconds"] = prepared.measure_seconds;
  done["replaced"] = std::get<proto::IngestOk>(sent).replaced;
  done["notes"] = prepared.notes;
  return done;
}

void print(const ordered_json& done) {
  for (const auto& note : done["notes"])
    std::cerr << done["file"].get<std::string>() << ": " << note.get<std::string>() << '\n';
  char rest[160];
  const double bits = done["bits_per_vertex"].is_null() ? 0.0 : done["bits_per_vertex"].get<double>();
  std::snprintf(rest, sizeof rest, "%llu levels, %llu vertices, %llu bytes, %.2f bits a vertex, %.2f s",
                done["packets"].get<unsigned long long>(), done["vertices"].get<unsigned long long>(),
                done["bytes"].get<unsigned long long>(), bits, done["seconds"].get<double>());
  std::cout << done["name"].get<std::string>() << ": generation " << done["generation"].get<std::string>() << ", "
            << rest << (done["replaced"].get<bool>() ? ", replaced" : "") << std::endl;
}

ordered_json error_object(const Failure& failure) {
  return {{"code", static_cast<unsigned>(failure.code)},
          {"name", std::string(proto::code_name(failure.code))},
          {"text", failure.text}};
}

/// All files, each on its own: one that fails does not keep the others out. Answers the first failure's exit code.
int run(const Common& common, const IngestCommand& command) {
  if (!command.name.empty() && command.files.size() > 1) {
    return report(common, "ingest",
                  {kUsage, proto::ErrorCode::none, "--name names one mesh, but there are several files"});
  }
  int exit_code = kDone;
  ordered_json document;
  document["ingested"] = ordered_json::array();
  document["failed"] = ordered_json::array();
  for (const std::string& path : command.files) {
    auto result = ingest(common, command, path);
    if (const auto* failed = std::get_if<Failure>(&result)) {
      if (exit_code == kDone) exit_code = failed->exit_code;
      if (common.json) {
        document["failed"].push_back({{"file", path}, {"error", error_object(*failed)}});
      } else {
        report(common, "ingest", *failed);
      }
      continue;
    }
    if (common.json) {
      document["ingested"].push_back(std::get<ordered_json>(result));
    } else {
      print(std::get<ordered_json>(result));
    }
  }
  if (common.json) std::cout << document.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  return exit_code;
}

}  // namespace

int report(const Common& common, const std::string& command, const Failure& failure) {
  if (common.json) {
    const ordered_json document{{"error", error_object(failure)}};
    std::cout << document.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
  } else {
    std::cerr << "pmcctl " << command << ": " << failure.text << '\n';
  }
  return failure.exit_code;
}

void add_ingest(CLI::App& app, const Common& common, int& exit_code) {
  CLI::App* sub = app.add_subcommand("ingest", "Encode mesh files and store them");
  const auto command = std::make_shared<IngestCommand>();
  sub->add_option("file", command->files, "PLY, OBJ, OFF, STL, or a .pmcd file")->required();
  sub->add_option("--name", command->name, "Name of the mesh; without it the file's name without extension");
  auto* bits = sub->add_option("--bits", command->bits, "Bits of the lattice; without it the mesh is kept bit for bit");
  bits->check(CLI::Range(4, 24));
  sub->add_option("--levels", command->levels, "At most this many packets after the base")->check(CLI::Range(1, 1000));
  sub->add_option("--effort", command->effort, "How hard to try; best: smaller, slower to write and to read")
      ->check(CLI::IsMember({"default", "best"}))
      ->capture_default_str()
      ->type_name("NAME");
  sub->add_flag("--cleaning", command->cleaning, "A cleaning conquest after each decimating one");
  sub->add_flag("--strict", command->strict, "Refuse files with data that would be left out");
  sub->add_flag("--replace", command->replace, "Replace a mesh of the same name");
  sub->callback([command, &common, &exit_code] { exit_code = run(common, *command); });
}

}  // namespace pmcd::admin
