// SPDX-License-Identifier: MIT
// The client library's inner face: a session with a server, blocking. Connect, list, open a mesh or go on in one, take
// packet after packet. One thread at a time uses a Session; work on the line happens only within its calls. It does not
// decode (give the packets to codec::Decoder) and does not go on by itself after a lost line (client/fetch.h does).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "client/address.h"
#include "client/result.h"
#include "codec/packet/directory.h"
#include "proto/bytes.h"
#include "proto/mesh_list.h"
#include "proto/messages.h"

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
  /// Asks every call of the session to end at once, connecting included; any thread may do so. The call gives
  /// `cancelled` and the session is closed.
  std::stop_token stop{};
  /// Told the server's notices of known kinds, within whatever call is waiting. Must not call the Session.
  std::function<void(const proto::Notice&)> on_notice{};
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
  std::uint64_t received = 0;  ///< of the packet, with the bytes that resume() was given
  std::uint64_t total = 0;
  /// What came since the last call: the bytes of the packet from received - bytes.size() on, not verified yet. Valid
  /// within the call.
  proto::ByteView bytes;
};

/// Called when bytes of the packet that is waited for have come; answers whether to go on. False cancels the transfer.
/// Must not call the Session.
using OnProgress = std::function<bool(const Progress&)>;

class Session {
 public:
  /// Opens both channels. Errors: cannot_reach, refused, violation, timed_out, lost, cancelled. A host given as a
  /// number is never looked up; a look-up that hangs is left behind and cleans up after itself.
  static Result<Session> connect(const Address& address, const Options& options = {});

  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // After violation, damaged, limit_exceeded, timed_out, lost, a stop by Options::stop, or refused with a code that
  // ends the session, the Session is closed and every further call gives the same error; but take_partial, and
  // next_packet for a packet that had come already.

  /// The meshes of the server whose names contain `filter` (see proto::matches_filter), ascending by name.
  Result<std::vector<proto::MeshListEntry>> list(const std::string& filter = {});
  /// One page of them: names greater than `after`, at most `most` (0: as many as the server puts on a page).
  Result<proto::MeshPage> list_page(const std::string& filter, const std::string& after, std::uint16_t most);

  /// Opens a mesh and returns when its directory is there; packet 0 is on its way and is what next_packet gives first.
  Result<OpenedMesh> open(const std::string& name);

  /// Opens the mesh of that generation so that next_packet gives packet number `packet` next. `begun` is what one has
  /// of it already: only what follows is asked for, and the packet is given (and checked) whole. Of a generation that
  /// is open in this session the handle is the known one. Errors: also refused with mesh_changed (the server has that
  /// content no more) or bad_range.
  Result<OpenedMesh> resume(std::uint64_t generation, std::uint32_t packet, proto::Bytes begun = {});

  /// The next packet of an opened mesh, nullopt after the last one. `on_progress` and `cancel` (from any thread) can
  /// end the transfer: then the error is `cancelled`, the session stands, and the next call for this mesh goes on at
  /// the byte that was reached. A cancel that crosses the end of the transfer is too late: the packet is given. Also
  /// no_such_handle.
  Result<std::optional<Packet>> next_packet(std::uint32_t handle, const OnProgress& on_progress = {},
                                            const std::stop_token& cancel = {});

  /// What has come of the packet that next_packet would give: after `cancelled`, or when the session has ended. Empties
  /// it; for resume() in a new session. Handle 0: what came for a resume() whose answer was lost, behind what was
  /// begun. Empty for an unknown handle.
  proto::Bytes take_partial(std::uint32_t handle);

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
