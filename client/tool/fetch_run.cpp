// SPDX-License-Identifier: GPL-3.0-or-later
// What pmctool fetch does while client::MeshFetch looks after the line.
#include "client/tool/fetch_run.h"

#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "client/fetch.h"
#include "client/tool/commands.h"
#include "client/tool/fetch_report.h"
#include "client/tool/part_file.h"
#include "client/tool/signals.h"
#include "codec/decoder.h"
#include "codec/import/file_io.h"
#include "codec/import/write_mesh.h"

namespace pmcd::tool {

int complain(int exit_code, const std::string& text) {
  std::cerr << "pmctool fetch: " << text << '\n';
  return exit_code;
}

namespace {

/// Beside a pipe or a device nothing can be kept.
bool can_keep_part(const std::string& out) {
  struct stat status {};
  return ::stat(out.c_str(), &status) != 0 || S_ISREG(status.st_mode);
}

std::string seconds_in_words(std::chrono::milliseconds time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f s", static_cast<double>(time.count()) / 1000);
  return text;
}

/// One fetch from the command line to the file.
class Fetch {
 public:
  Fetch(const FetchCommand& command, const client::Address& address)
      : command_(command), address_(address), keeps_part_(can_keep_part(command.out)), part_(command.out + ".part") {}

  int run();

 private:
  int take_part();
  int fetch();
  int finish(const client::FetchSummary& summary);
  int explain(const client::Error& error);
  client::FetchCallbacks callbacks();
  void begin(const codec::Directory& directory, proto::ByteView directory_bytes);
  bool take_level(std::uint32_t level, proto::ByteView packet);
  int write_mesh(const std::string& path);
  [[nodiscard]] std::string level_path(std::uint32_t level) const;
  /// Remembers the exit code of what went wrong here, not at the server; answers false.
  bool stop_with(int exit_code, const std::string& text);
  [[nodiscard]] bool as_packets() const { return import::extension_of(command_.out) == "pmcd"; }

  const FetchCommand& command_;
  const client::Address& address_;
  bool keeps_part_;
  PartFile part_;
  StopOnSignal stop_;
  FetchReport report_;
  codec::Decoder decoder_;
  std::optional<PartFile::Loaded> loaded_;
  std::size_t levels_ = 0;     ///< of the mesh
  proto::Bytes packets_file_;  ///< for a .pmcd that no partial file stands behind
  int failed_here_ = kExitDone;
};

bool Fetch::stop_with(int exit_code, const std::string& text) {
  report_.leave_line();
  failed_here_ = complain(exit_code, text);
  return false;
}

int Fetch::write_mesh(const std::string& path) {
  const auto notes = import::write_mesh(path, decoder_.mesh());
  if (!notes) return complain(kExitBadInput, import::to_line(notes.error()));
  for (const std::string& note : *notes) std::cerr << "pmctool fetch: " << path << ": " << note << '\n';
  return kExitDone;
}

std::string Fetch::level_path(std::uint32_t level) const {
  std::string extension = import::extension_of(command_.out);
  if (extension == "pmcd") extension = "ply";
  char name[32];
  std::snprintf(name, sizeof name, "level-%03u.", level);
  return (std::filesystem::path(command_.each_level) / (name + extension)).string();
}

int Fetch::run() {
  if (!command_.each_level.empty()) {
    std::error_code error;
    std::filesystem::create_directories(command_.each_level, error);
    if (error) return complain(kExitBadInput, command_.each_level + ": cannot make this folder: " + error.message());
  }
  if (const int failed = take_part(); failed != kExitDone) return failed;
  return fetch();
}

/// What an earlier run left, if it is to be used.
int Fetch::take_part() {
  if (!keeps_part_) {
    if (!command_.resume) return kExitDone;
    return complain(kExitUsage, command_.out + " is no regular file: there is nothing to resume");
  }
  if (!command_.resume) {
    if (!part_.exists()) return kExitDone;
    return complain(kExitUsage,
                    part_.path() + " holds a part of an earlier download: go on with --resume, or delete it");
  }
  auto loaded = part_.load();
  if (!loaded) return complain(kExitBadInput, import::to_line(loaded.error()));
  loaded_ = std::move(loaded).value();
  const std::uint64_t dropped = loaded_ ? loaded_->bytes_dropped : part_.bytes_lost();
  if (dropped > 0) {
    report_.note(part_.path() + ": " + std::to_string(dropped) + " bytes are damaged and will be fetched again");
  }
  if (!loaded_) return kExitDone;
  const client::FetchState& state = loaded_->state;
  report_.note("resuming behind " + std::to_string(state.packets_done) + " packets and " +
               std::to_string(state.partial.size()) + " bytes of the next one");
  return kExitDone;
}

void Fetch::begin(const codec::Directory& directory, proto::ByteView directory_bytes) {
  levels_ = directory.levels.size();
  const auto top = static_cast<std::uint32_t>(levels_ - 1);
  report_.begin(directory, command_.level.value_or(top));
  if (loaded_) {
    for (std::uint32_t k = 0; k < loaded_->packets.size() && k <= command_.level.value_or(top); ++k) {
      if (!take_level(k, loaded_->packets[k])) break;
    }
    loaded_.reset();
  } else if (keeps_part_) {
    if (const auto failure = part_.begin(directory, directory_bytes)) {
      stop_with(kExitBadInput, import::to_line(*failure));
    }
  } else if (as_packets()) {
    packets_file_.assign(directory_bytes.begin(), directory_bytes.end());
  }
  report_.waiting();
}

/// A verified packet becomes a level. False if that failed here.
bool Fetch::take_level(std::uint32_t level, proto::ByteView packet) {
  if (const auto applied = decoder_.apply(packet); !applied) {
    return stop_with(kExitBadInput, "packet " + std::to_string(level) + " of \"" + command_.name +
                                        "\" cannot be decoded: " + applied.error().detail + " [" +
                                        codec::error_name(applied.error().code) + "]");
  }
  report_.level(level);
  if (!keeps_part_ && as_packets()) packets_file_.insert(packets_file_.end(), packet.begin(), packet.end());
  if (command_.each_level.empty()) return true;
  const int failed = write_mesh(level_path(level));
  if (failed == kExitDone) return true;
  report_.leave_line();
  failed_here_ = failed;
  return false;
}

client::FetchCallbacks Fetch::callbacks() {
  client::FetchCallbacks calls;
  calls.on_directory = [this](const codec::Directory& directory, proto::ByteView bytes) { begin(directory, bytes); };
  calls.on_progress = [this](const client::Progress& progress) {
    if (failed_here_ != kExitDone) return false;
    report_.chunk(progress.packet, progress.received, progress.bytes.size());
    if (!keeps_part_) return true;
    const auto failure = part_.write(progress.packet, progress.received - progress.bytes.size(), progress.bytes);
    return failure ? stop_with(kExitBadInput, import::to_line(*failure)) : true;
  };
  calls.on_level = [this](const client::FetchedLevel& level) {
    report_.arrived();
    const bool good = failed_here_ == kExitDone && take_level(level.level, level.packet);
    report_.waiting();
    return good;
  };
  calls.on_retry = [this](const client::RetryNotice& retry) {
    report_.note(retry.error.text + "; trying again in " + seconds_in_words(retry.pause));
  };
  calls.on_restart = [this] {
    report_.note("\"" + command_.name +
                 "\" on the server is another mesh than what came so far, which is thrown away: beginning anew");
    decoder_ = codec::Decoder();
    loaded_.reset();
  };
  return calls;
}

int Fetch::fetch() {
  client::FetchOptions options;
  options.session.agent = "pmctool fetch";
  options.session.stop = stop_.token();
  options.session.on_notice = [this](const proto::Notice& notice) {
    report_.note("the server says: " + (notice.text.empty() ? std::string(notice.kind == proto::NoticeKind::draining
                                                                              ? "it is ending"
                                                                              : "the mesh was replaced "
                                                                                "or removed")
                                                            : notice.text));
  };
  options.last_level = command_.level;
  options.begin_again_if_changed = true;
  options.retry.most_tries = command_.give_up_after > 0 ? client::RetryOptions::kAnyNumber : 0;
  options.retry.give_up_after =
      std::chrono::milliseconds(static_cast<std::int64_t>(std::lround(command_.give_up_after * 1000)));

  client::MeshFetch mesh_fetch(address_, command_.name, options, callbacks(),
                               loaded_ ? loaded_->state : client::FetchState{});
  const auto fetched = mesh_fetch.run();
  report_.leave_line();
  if (fetched && failed_here_ == kExitDone) return finish(*fetched);

  const int exit_code = failed_here_ != kExitDone ? failed_here_ : explain(fetched.error());
  if (!keeps_part_ || part_.bytes_lost() > 0) return exit_code;
  if (!part_.worth_keeping()) {
    part_.remove();
  } else {
    complain(exit_code, "what came is kept in " + part_.path() + "; the same command with --resume goes on there");
  }
  return exit_code;
}

int Fetch::explain(const client::Error& error) {
  if (error.failure == client::Failure::cancelled && stop_.signal() != 0) {
    return complain(kExitSignal + stop_.signal(), "stopped by " + signal_name(stop_.signal()));
  }
  if (error.failure == client::Failure::no_such_level) return complain(kExitUsage, error.text);
  const bool unknown = error.code == proto::ErrorCode::unknown_mesh;
  return complain(kExitRefused,
                  error.text + (unknown ? " (\"pmctool list " + command_.server + "\" shows what there is)" : ""));
}

int Fetch::finish(const client::FetchSummary& summary) {
  const double seconds = report_.seconds();
  if (!as_packets()) {
    if (const int failed = write_mesh(command_.out); failed != kExitDone) return failed;
  } else {
    auto bytes = keeps_part_ ? import::load_file(part_.path())
                             : import::ImportResult<std::vector<std::byte>>(std::move(packets_file_));
    if (!bytes) return complain(kExitBadInput, import::to_line(bytes.error()));
    if (const auto failure = import::save_file(command_.out, *bytes)) {
      return complain(kExitBadInput, import::to_line(*failure));
    }
  }
  part_.remove();
  const codec::Level level = decoder_.level();
  char time[32];
  std::snprintf(time, sizeof time, "%.2f s", seconds);
  std::cout << command_.name << ": level " << level.level << " of " << levels_ - 1 << ", " << level.vertices
            << " vertices, " << level.faces << " faces, " << summary.bytes_received << " bytes in " << time
            << ", written to " << command_.out << '\n';
  return kExitDone;
}

}  // namespace

int run_fetch(const FetchCommand& command, const client::Address& address) {
  return Fetch(command, address).run();
}

}  // namespace pmcd::tool
