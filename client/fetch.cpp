// SPDX-License-Identifier: MIT
// One run of a fetch: attempts, each with a session of its own, and the pauses between them.
#include "client/fetch.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <random>
#include <utility>

#include "client/packet_check.h"

namespace pmcd::client {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

Error cancelled() {
  return {Failure::cancelled, proto::ErrorCode::none, "stopped as asked"};
}

/// Refusals that say nothing about the mesh and pass with time or with a better line.
bool passes(proto::ErrorCode code) {
  switch (code) {
    case proto::ErrorCode::too_many_sessions:
    case proto::ErrorCode::shutting_down:
    case proto::ErrorCode::channel_lost:
    case proto::ErrorCode::stalled:
    case proto::ErrorCode::hello_timeout:
    case proto::ErrorCode::join_timeout:
    case proto::ErrorCode::bad_token:  // the server was started anew between hello and join
      return true;
    default:
      return false;
  }
}

bool same_packets(const codec::Directory& a, const codec::Directory& b) {
  return std::equal(a.levels.begin(), a.levels.end(), b.levels.begin(), b.levels.end(),
                    [](const codec::LevelEntry& x, const codec::LevelEntry& y) {
                      return x.bytes == y.bytes && x.crc32c == y.crc32c;
                    });
}

/// False if `stop` ended the pause.
bool pause_for(milliseconds time, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait_for(lock, stop, time, [] { return false; });
  return !stop.stop_requested();
}

class Run {
 public:
  Run(const Address& address, const std::string& name, const FetchOptions& options, const FetchCallbacks& callbacks,
      FetchState& state)
      : address_(address),
        name_(name),
        options_(options),
        callbacks_(callbacks),
        state_(state),
        backoff_(options.retry, Clock::now(), std::random_device{}()) {}

  Result<FetchSummary> run();

 private:
  std::optional<Error> read_state();
  std::optional<Error> attempt();
  std::optional<Error> check_name(Session& session);
  std::optional<Error> take_directory(const OpenedMesh& mesh);
  std::optional<Error> take_level(Session& session, const OpenedMesh& mesh);
  std::optional<Error> give_out(const OpenedMesh& mesh, proto::ByteView packet);
  std::optional<Error> keep_partial(Session& session, const OpenedMesh& mesh, const Error& error);
  void keep_answerless(proto::Bytes partial);
  /// After a failed attempt: pauses, or gives the error that run() ends with.
  std::optional<Error> recover(Error error);
  [[nodiscard]] bool worth_retrying(const Error& error) const;
  std::optional<Error> set_directory(codec::Directory directory);
  void restart();
  bool on_progress(const Progress& progress);
  [[nodiscard]] bool has_state() const { return !state_.directory_bytes.empty(); }
  [[nodiscard]] std::uint32_t last_level() const {
    return options_.last_level.value_or(static_cast<std::uint32_t>(directory_.levels.size() - 1));
  }
  [[nodiscard]] bool complete() const { return has_state() && state_.packets_done > last_level(); }

  const Address& address_;
  const std::string& name_;
  const FetchOptions& options_;
  const FetchCallbacks& callbacks_;
  FetchState& state_;
  Backoff backoff_;
  FetchSummary summary_;
  codec::Directory directory_;  ///< of the state, if it has one
  bool name_checked_ = true;    ///< the state's generation is known to be that of the name
  bool reached_ = false;        ///< a server has answered
  bool stitched_ = false;       ///< the packet under way began on another line
  bool stopped_ = false;        ///< a callback said so
};

Result<FetchSummary> Run::run() {
  if (has_state()) {
    if (auto error = read_state()) return *error;
    name_checked_ = false;
  }
  while (!complete()) {
    auto error = attempt();
    if (error && !complete()) error = recover(std::move(*error));
    if (error && !complete()) return *error;
  }
  return summary_;
}

std::optional<Error> Run::read_state() {
  const auto bad = [](const std::string& what) {
    return Error{Failure::bad_state, proto::ErrorCode::none, "cannot go on from this state: " + what};
  };
  auto parsed = codec::parse_directory(state_.directory_bytes);
  if (!parsed) return bad(parsed.error().detail);
  const std::vector<codec::LevelEntry>& levels = parsed->directory.levels;
  if (parsed->size != state_.directory_bytes.size() || levels.empty()) return bad("its directory is not valid");
  if (parsed->directory.generation != state_.generation) return bad("its directory is of another generation");
  if (state_.packets_done > levels.size()) return bad("it has more packets than its directory");
  const std::size_t most = state_.packets_done < levels.size() ? levels[state_.packets_done].bytes : 1;
  if (state_.partial.size() >= most) return bad("its partial packet is not partial");
  return set_directory(std::move(parsed->directory));
}

std::optional<Error> Run::set_directory(codec::Directory directory) {
  directory_ = std::move(directory);
  const std::size_t top = directory_.levels.size() - 1;
  if (options_.last_level && *options_.last_level > top) {
    return Error{Failure::no_such_level, proto::ErrorCode::none,
                 "\"" + name_ + "\" has the levels 0 to " + std::to_string(top) + ", not " +
                     std::to_string(*options_.last_level)};
  }
  if (callbacks_.on_directory) callbacks_.on_directory(directory_, state_.directory_bytes);
  return std::nullopt;
}

std::optional<Error> Run::attempt() {
  auto session = Session::connect(address_, options_.session);
  if (!session) {
    const Failure failure = session.error().failure;
    if (failure != Failure::cannot_reach && failure != Failure::timed_out) reached_ = true;
    return session.error();
  }
  reached_ = true;
  if (!name_checked_) {
    if (auto error = check_name(*session)) return error;
    name_checked_ = true;
  }
  const auto mesh =
      has_state() ? session->resume(state_.generation, state_.packets_done, state_.partial) : session->open(name_);
  stitched_ = !state_.partial.empty();
  if (!mesh) {
    if (has_state()) keep_answerless(session->take_partial(0));
    return mesh.error();
  }
  if (auto error = take_directory(*mesh)) return error;
  while (!complete()) {
    if (auto error = take_level(*session, *mesh)) return error;
  }
  return std::nullopt;
}

/// A generation is found without a name, so a state of another mesh would be completed just as gladly.
std::optional<Error> Run::check_name(Session& session) {
  const auto meshes = session.list(name_);
  if (!meshes) return meshes.error();
  const auto found = std::find_if(meshes->begin(), meshes->end(),
                                  [&](const proto::MeshListEntry& mesh) { return mesh.name == name_; });
  if (found != meshes->end() && found->generation == state_.generation) return std::nullopt;
  return Error{Failure::refused, proto::ErrorCode::mesh_changed,
               found == meshes->end() ? "the server has no mesh \"" + name_ + "\" any more"
                                      : "\"" + name_ + "\" is not the mesh any more of which a part is here"};
}

std::optional<Error> Run::take_directory(const OpenedMesh& mesh) {
  if (has_state()) {
    if (same_packets(directory_, mesh.directory)) return std::nullopt;
    return Error{Failure::violation, proto::ErrorCode::none,
                 "the server broke the protocol: the same generation with other packets"};
  }
  state_.generation = mesh.generation;
  state_.directory_bytes = mesh.directory_bytes;
  return set_directory(mesh.directory);
}

std::optional<Error> Run::take_level(Session& session, const OpenedMesh& mesh) {
  const auto packet = session.next_packet(mesh.handle, [this](const Progress& p) { return on_progress(p); });
  if (!packet) return keep_partial(session, mesh, packet.error());
  if (!*packet) {
    return Error{Failure::violation, proto::ErrorCode::none,
                 "the server broke the protocol: the mesh ended before its last level"};
  }
  return give_out(mesh, (*packet)->bytes);
}

std::optional<Error> Run::give_out(const OpenedMesh& mesh, proto::ByteView packet) {
  const std::uint32_t level = state_.packets_done++;
  ++summary_.levels;
  state_.partial = {};
  stitched_ = false;
  if (callbacks_.on_level && !callbacks_.on_level({level, complete(), packet, mesh})) stopped_ = true;
  if (stopped_ && !complete()) return cancelled();
  return std::nullopt;
}

/// What there is of the packet that did not come whole; gives the error back. If all its bytes had come and only its
/// end was lost, it is a level like any other.
std::optional<Error> Run::keep_partial(Session& session, const OpenedMesh& mesh, const Error& error) {
  if (error.failure == Failure::violation) return error;
  if (error.failure == Failure::damaged) {
    if (stitched_) state_.partial.clear();
    return error;
  }
  proto::Bytes partial = session.take_partial(mesh.handle);
  const std::size_t whole = directory_.levels[state_.packets_done].bytes;
  if (partial.size() < whole) {
    if (partial.size() > state_.partial.size()) state_.partial = std::move(partial);
  } else if (!wrong_with_packet(directory_, state_.packets_done, partial)) {
    if (auto stopped = give_out(mesh, partial)) return stopped;
  } else {
    state_.partial.clear();
  }
  return error;
}

/// Bytes may come before the answer that names their handle, and the line may break in between.
void Run::keep_answerless(proto::Bytes partial) {
  const std::size_t total = directory_.levels[state_.packets_done].bytes;
  if (partial.size() <= state_.partial.size() || partial.size() >= total) return;
  on_progress({state_.packets_done, partial.size(), total, proto::ByteView(partial).subspan(state_.partial.size())});
  state_.partial = std::move(partial);
}

bool Run::on_progress(const Progress& progress) {
  summary_.bytes_received += progress.bytes.size();
  backoff_.progress(Clock::now());
  if (callbacks_.on_progress && !callbacks_.on_progress(progress)) stopped_ = true;
  return !stopped_;
}

bool Run::worth_retrying(const Error& error) const {
  switch (error.failure) {
    case Failure::lost:
    case Failure::timed_out:
      return true;
    case Failure::cannot_reach:
      return reached_;
    case Failure::refused:
      return passes(error.code);
    case Failure::damaged:
      return stitched_;
    default:
      return false;
  }
}

std::optional<Error> Run::recover(Error error) {
  if (stopped_ || options_.session.stop.stop_requested()) return cancelled();
  const bool changed = error.failure == Failure::refused && error.code == proto::ErrorCode::mesh_changed;
  const bool again = changed && has_state() && options_.begin_again_if_changed;
  if (!again && !worth_retrying(error)) return error;
  auto pause = backoff_.failed(Clock::now());
  if (!pause) {
    if (backoff_.tries() > 1)
      error.text = "gave up after " + std::to_string(backoff_.tries()) + " tries: " + error.text;
    return error;
  }
  if (again) {
    restart();
    if (backoff_.tries() == 1) pause = milliseconds(0);
  } else {
    ++summary_.retries;
    if (callbacks_.on_retry) callbacks_.on_retry({error, *pause, backoff_.tries()});
  }
  if (!pause_for(*pause, options_.session.stop)) return cancelled();
  return std::nullopt;
}

void Run::restart() {
  state_ = {};
  name_checked_ = true;
  summary_.levels = 0;
  if (callbacks_.on_restart) callbacks_.on_restart();
}

}  // namespace

MeshFetch::MeshFetch(Address address, std::string name, FetchOptions options, FetchCallbacks callbacks,
                     FetchState state)
    : address_(std::move(address)),
      name_(std::move(name)),
      options_(std::move(options)),
      callbacks_(std::move(callbacks)),
      state_(std::move(state)) {}

Result<FetchSummary> MeshFetch::run() {
  return Run(address_, name_, options_, callbacks_, state_).run();
}

}  // namespace pmcd::client
