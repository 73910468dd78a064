// SPDX-License-Identifier: MIT
// The client library's public face: a session with a server, blocking. Connect, list, open a mesh, take packet after
// packet. One thread at a time uses a Session; work on the line happens only within its calls. It does not decode (give
// the packets to codec::Decoder) and does not go on by itself after a lost line.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/address.h"
#include "client/result.h"
#include "codec/packet/directory.h"
#include "proto/bytes.h"
#include "proto/mesh_list.h"

namespace pmcd::client {

struct Options {
  /// For looking up, both connections, hello and join together.
  std::chrono::milliseconds connect_timeout{10'000};
  /// A server that is silent for half of this is sent a ping; one silent for all of it is given up. A request that
  /// waits in the server's queue does not count as silence.
  std::chrono::milliseconds silence_timeout{30'000};
  /// A request is given up after so long without a byte on the data channel, although the server answers pings.
  std::chrono::milliseconds progress_timeout{600'000};
  std::uint64_t max_packet_bytes = std::uint64_t{1} << 32;
  std::string agent = "pmcd client library";  ///< for the server's log; at most 64 bytes
};

struct OpenedMesh {
  std::uint32_t handle = 0;
  std::uint64_t generation = 0;
  codec::Directory directory;
  proto::Bytes directory_bytes;  ///< as it stands at the start of a .pmcd file
};

struct Packet {
  std::uint32_t number = 0;
  proto::Bytes bytes;  ///< a whole packet, its checksum right and equal to the directory's
};

struct Progress {
  std::uint32_t packet = 0;
  std::uint64_t received = 0;
  std::uint64_t total = 0;
};

/// Called after each chunk of the transfer that is waited for.
using OnProgress = std::function<void(const Progress&)>;

class Session {
 public:
  /// Opens both channels. Errors: cannot_reach, refused, violation, timed_out, lost.
  static Result<Session> connect(const Address& address, const Options& options = {});

  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // After violation, damaged, limit_exceeded, timed_out, lost, or refused with a code that ends the session, the
  // Session is closed and every further call gives the same error.

  /// The meshes of the server whose names contain `filter` (see proto::matches_filter), ascending by name.
  Result<std::vector<proto::MeshListEntry>> list(const std::string& filter = {});
  /// One page of them: names greater than `after`, at most `most` (0: as many as the server puts on a page).
  Result<proto::MeshPage> list_page(const std::string& filter, const std::string& after, std::uint16_t most);

  /// Opens a mesh and returns when its directory is there; packet 0 is on its way and is what next_packet gives first.
  Result<OpenedMesh> open(const std::string& name);

  /// The next packet of an opened mesh, nullopt after the last one. Also no_such_handle.
  Result<std::optional<Packet>> next_packet(std::uint32_t handle, const OnProgress& on_progress = {});

  /// There and back on the request channel.
  Result<std::chrono::microseconds> ping();

  /// The server's name and version as it gave them.
  [[nodiscard]] const std::string& server_agent() const;

  /// Says goodbye and closes; the destructor does the same. Never waits.
  void close();

 private:
  class Core;
  explicit Session(std::unique_ptr<Core> core);
  std::unique_ptr<Core> core_;
};

}  // namespace pmcd::client
