// SPDX-License-Identifier: MIT
// The client library's face for most programs: fetch a mesh level by level, whatever the line does. Connects, opens or
// resumes, checks every packet, and after a lost line goes on by itself at the byte that was reached. Blocking; one
// thread at a time. It does not decode (give the packets to codec::Decoder) and stores nothing.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/backoff.h"
#include "client/session.h"

namespace pmcd::client {

/// What is there of a mesh: a plain value that a program can store and give back later. Directory and whole packets one
/// after the other, then `partial`, are the beginning of a .pmcd file.
struct FetchState {
  std::uint64_t generation = 0;
  proto::Bytes directory_bytes;    ///< empty: nothing is there, not even the directory
  std::uint32_t packets_done = 0;  ///< whole packets that the program has
  proto::Bytes partial;            ///< the beginning of packet number `packets_done`, not verified yet
};

/// One more level: a whole packet, verified.
struct FetchedLevel {
  std::uint32_t level = 0;
  bool last = false;  ///< of those that are wanted
  proto::ByteView packet;
  const OpenedMesh& mesh;
};

/// Why there is a pause, and how long it is.
struct RetryNotice {
  Error error;
  std::chrono::milliseconds pause{0};
  std::uint32_t tries = 0;  ///< that have failed in a row, this one included
};

/// All are called on the thread of run() and must not call the MeshFetch. Each may be empty.
struct FetchCallbacks {
  /// The directory is known: once at the beginning, at once if the state has it, and again after on_restart.
  std::function<void(const codec::Directory& directory, proto::ByteView directory_bytes)> on_directory;
  /// A level is there; answers whether to go on.
  std::function<bool(const FetchedLevel&)> on_level;
  /// Bytes of a packet have come; answers whether to go on. After a packet that turned out damaged behind a beginning
  /// from an earlier line, the same packet comes again from its first byte.
  OnProgress on_progress;
  std::function<void(const RetryNotice&)> on_retry;
  /// The mesh was replaced meanwhile: all levels so far are to be thrown away, level 0 comes next.
  std::function<void()> on_restart;
};

struct FetchOptions {
  Options session;  ///< its `stop` also ends pauses
  RetryOptions retry;
  std::optional<std::uint32_t> last_level;  ///< stop behind this one; default: the last of the mesh
  /// What to do when the server has another content under the name, or none: begin again with it, or end with
  /// mesh_changed.
  bool begin_again_if_changed = false;
};

struct FetchSummary {
  std::uint32_t levels = 0;          ///< that came in this run
  std::uint64_t bytes_received = 0;  ///< of packets, in this run
  std::uint32_t retries = 0;
};

class MeshFetch {
 public:
  /// `state`: where to go on; the levels that it counts as done are not given out again.
  MeshFetch(Address address, std::string name, FetchOptions options, FetchCallbacks callbacks, FetchState state = {});

  /// Works until all levels that are wanted are there. A state that is given is used only if the server still has its
  /// generation under the name. Errors: those of Session (the last one when it gives up); refused with mesh_changed;
  /// bad_state; no_such_level; cancelled, when a callback or Options::stop said so. After an error state() says what is
  /// there, and run() may be called again.
  ///
  /// Tried again are: lost and timed-out lines, a server that cannot be reached any more (one that never could be is
  /// told at once), and refusals that pass (too_many_sessions, shutting_down, stalled and the like).
  Result<FetchSummary> run();

  /// Up to date whenever run() has returned.
  [[nodiscard]] const FetchState& state() const { return state_; }

 private:
  Address address_;
  std::string name_;
  FetchOptions options_;
  FetchCallbacks callbacks_;
  FetchState state_;
};

}  // namespace pmcd::client
