// SPDX-License-Identifier: GPL-3.0-or-later
// pmctool fetch: takes a mesh from a server packet by packet, decodes as they come, and writes the level that was asked
// for. A terminal sees one live line; anything else gets a line a level.
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/session.h"
#include "client/tool/commands.h"
#include "codec/decoder.h"
#include "codec/import/file_io.h"
#include "codec/import/write_mesh.h"

namespace pmcd::tool {

namespace {

using Clock = std::chrono::steady_clock;

struct FetchOptions {
  std::string server;
  std::string name;
  std::string out;
  std::optional<std::uint32_t> level;
  std::string each_level;
};

int complain(int exit_code, const std::string& text) {
  std::cerr << "pmctool fetch: " << text << '\n';
  return exit_code;
}

std::string amount(double bytes) {
  const char* unit = "B";
  for (const char* larger : {"kB", "MB", "GB"}) {
    if (bytes < 1000) break;
    bytes /= 1000;
    unit = larger;
  }
  char text[32];
  std::snprintf(text, sizeof text, unit[0] == 'B' ? "%.0f %s" : "%.1f %s", bytes, unit);
  return text;
}

/// Columns of the terminal on stderr: a longer line would wrap and could not be overwritten.
std::size_t columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80;
}

/// What the person sees while it runs.
class Report {
 public:
  Report(const codec::Directory& directory, std::uint32_t last)
      : directory_(directory), last_(last), terminal_(::isatty(STDERR_FILENO) == 1) {}

  /// Before a packet is waited for: time spent decoding and writing is no fault of the line.
  void waiting() { waiting_since_ = Clock::now(); }

  void chunk(std::uint32_t level, std::uint64_t received) {
    const auto now = Clock::now();
    if (!terminal_ || now < shown_at_ + std::chrono::milliseconds(50)) return;
    shown_at_ = now;
    show(level, done_ + received, level == 0 ? std::nullopt : std::optional(level - 1), "\r", "\x1b[K");
  }

  /// The packet is there.
  void arrived() {
    on_the_line_ += Clock::now() - *waiting_since_;
    waiting_since_.reset();
  }

  /// The packet is decoded.
  void level(std::uint32_t level) {
    done_ += directory_.levels[level].bytes;
    show(level, done_, level, terminal_ ? "\r" : "", terminal_ ? (level == last_ ? "\x1b[K\n" : "\x1b[K") : "\n");
    open_line_ = terminal_ && level != last_;
  }

  /// Ends the live line so that what is printed next stands on its own.
  void leave_line() {
    if (open_line_) std::cerr << '\n';
    open_line_ = false;
  }

  [[nodiscard]] std::uint64_t bytes() const { return done_; }
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  /// `standing`: the level whose shape is there already. Fields are two blanks apart; scripts read the long form.
  void show(std::uint32_t level, std::uint64_t bytes, std::optional<std::uint32_t> standing, const char* before,
            const char* after) {
    std::string line = "level " + std::to_string(level) + "/" + std::to_string(directory_.levels.size() - 1) + "  " +
                       amount(static_cast<double>(bytes));
    if (standing) line += shape_of(directory_.levels[*standing]);
    char time[32];
    std::snprintf(time, sizeof time, "  %.2f s  ", seconds());
    line += time + amount(static_cast<double>(bytes) / std::max(on_the_line(), 1e-6)) + "/s";
    if (terminal_) line.resize(std::min(line.size(), columns() - 1));
    std::cerr << before << line << after << std::flush;
    open_line_ = terminal_;
  }

  /// Short on a terminal, where the line must not wrap: error is RMS there.
  [[nodiscard]] std::string shape_of(const codec::LevelEntry& entry) const {
    std::string shape = "  " + std::to_string(entry.vertices) + " vertices";
    if (!terminal_) shape += "  " + std::to_string(entry.faces) + " faces";
    if (entry.error_rms < 0) return shape;
    char text[64];
    if (terminal_) {
      std::snprintf(text, sizeof text, "  error %.3g%%", 100 * entry.error_rms);
    } else {
      std::snprintf(text, sizeof text, "  error %.3g%% rms %.3g%% max", 100 * entry.error_rms, 100 * entry.error_max);
    }
    return shape + text;
  }

  [[nodiscard]] double on_the_line() const {
    const Clock::duration now = waiting_since_ ? Clock::now() - *waiting_since_ : Clock::duration::zero();
    return std::chrono::duration<double>(on_the_line_ + now).count();
  }

  const codec::Directory& directory_;
  std::uint32_t last_;
  bool terminal_;
  bool open_line_ = false;
  std::uint64_t done_ = 0;
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_at_{};
  Clock::duration on_the_line_{0};
  std::optional<Clock::time_point> waiting_since_;
};

/// A complaint about a request that cannot be right, before anything is asked of the server.
std::optional<std::string> check_usage(const FetchOptions& options) {
  const std::string extension = import::extension_of(options.out);
  if (extension == "pmcd") {
    if (options.level) return "a .pmcd file holds the whole mesh: leave --level out, or write PLY, OBJ, OFF or STL";
    return std::nullopt;
  }
  const auto formatted = import::format_mesh({}, extension);
  if (!formatted && formatted.error().code == import::ImportErrorCode::unknown_extension) {
    return "\"" + options.out + "\": the name does not say which format; end it in .ply, .obj, .off, .stl or .pmcd";
  }
  return std::nullopt;
}

int write(const std::string& path, const codec::TriangleMesh& mesh) {
  const auto notes = import::write_mesh(path, mesh);
  if (!notes) return complain(kExitBadInput, import::to_line(notes.error()));
  for (const std::string& note : *notes) std::cerr << "pmctool fetch: " << path << ": " << note << '\n';
  return kExitDone;
}

std::string level_path(const FetchOptions& options, std::uint32_t level) {
  std::string extension = import::extension_of(options.out);
  if (extension == "pmcd") extension = "ply";
  char name[32];
  std::snprintf(name, sizeof name, "level-%03u.", level);
  return (std::filesystem::path(options.each_level) / (name + extension)).string();
}

/// Fetches and decodes up to `last`; keeps the packets' bytes in `file` if it is given.
int fetch_levels(client::Session& session, const client::OpenedMesh& mesh, std::uint32_t last,
                 const FetchOptions& options, codec::Decoder& decoder, Report& report, proto::Bytes* file) {
  for (std::uint32_t k = 0; k <= last; ++k) {
    report.waiting();
    const auto packet =
        session.next_packet(mesh.handle, [&](const client::Progress& p) { report.chunk(p.packet, p.received); });
    if (!packet || !*packet) {
      report.leave_line();
      return complain(kExitRefused, packet ? "the mesh ended before its last level" : packet.error().text);
    }
    report.arrived();
    const proto::Bytes& bytes = (*packet)->bytes;
    const auto level = decoder.apply(bytes);
    if (!level) {
      report.leave_line();
      return complain(kExitBadInput, "packet " + std::to_string(k) + " of \"" + options.name +
                                         "\" cannot be decoded: " + level.error().detail + " [" +
                                         codec::error_name(level.error().code) + "]");
    }
    report.level(k);
    if (file != nullptr) file->insert(file->end(), bytes.begin(), bytes.end());
    if (options.each_level.empty()) continue;
    if (const int failed = write(level_path(options, k), decoder.mesh()); failed != kExitDone) {
      report.leave_line();
      return failed;
    }
  }
  return kExitDone;
}

int run(const FetchOptions& options) {
  const auto address = client::parse_address(options.server);
  if (!address) return complain(kExitUsage, address.error().text);
  if (const auto wrong = check_usage(options)) return complain(kExitUsage, *wrong);
  if (!options.each_level.empty()) {
    std::error_code error;
    std::filesystem::create_directories(options.each_level, error);
    if (error) return complain(kExitBadInput, options.each_level + ": cannot make this folder: " + error.message());
  }

  client::Options session_options;
  session_options.agent = "pmctool fetch";
  auto session = client::Session::connect(*address, session_options);
  if (!session) return complain(kExitRefused, session.error().text);
  const auto mesh = session->open(options.name);
  if (!mesh) {
    const bool unknown = mesh.error().code == proto::ErrorCode::unknown_mesh;
    return complain(
        kExitRefused,
        mesh.error().text + (unknown ? " (\"pmctool list " + options.server + "\" shows what there is)" : ""));
  }
  const auto top = static_cast<std::uint32_t>(mesh->directory.levels.size() - 1);
  if (options.level && *options.level > top) {
    return complain(kExitUsage, "\"" + options.name + "\" has the levels 0 to " + std::to_string(top) + ", not " +
                                    std::to_string(*options.level));
  }
  const std::uint32_t last = options.level.value_or(top);
  const bool as_file = import::extension_of(options.out) == "pmcd";

  codec::Decoder decoder;
  Report report(mesh->directory, last);
  proto::Bytes file = as_file ? mesh->directory_bytes : proto::Bytes{};
  const int failed = fetch_levels(*session, *mesh, last, options, decoder, report, as_file ? &file : nullptr);
  if (failed != kExitDone) return failed;
  const double seconds = report.seconds();
  session->close();

  if (as_file) {
    if (const auto error = import::save_file(options.out, file))
      return complain(kExitBadInput, import::to_line(*error));
  } else if (const int not_written = write(options.out, decoder.mesh()); not_written != kExitDone) {
    return not_written;
  }
  const codec::Level level = decoder.level();
  char time[32];
  std::snprintf(time, sizeof time, "%.2f s", seconds);
  std::cout << options.name << ": level " << level.level << " of " << top << ", " << level.vertices << " vertices, "
            << level.faces << " faces, " << report.bytes() << " bytes in " << time << ", written to " << options.out
            << '\n';
  return kExitDone;
}

}  // namespace

void add_fetch(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("fetch", "Fetch a mesh from a server, level by level");
  const auto options = std::make_shared<FetchOptions>();
  command->add_option("server", options->server, "HOST[:PORT]; an IPv6 address in brackets")->required();
  command->add_option("name", options->name, "Name of the mesh")->required();
  command->add_option("out", options->out, "File to write: .ply, .obj, .off, .stl, or .pmcd for the packets")
      ->required();
  command->add_option("--level", options->level, "Stop at this level (0 is the base mesh)");
  command->add_option("--each-level", options->each_level, "Also write each level into this folder");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace pmcd::tool
