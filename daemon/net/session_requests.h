// SPDX-License-Identifier: MIT
// What a client asks for within a standing session: its open requests, the meshes it has opened, how far it has come in
// each, and the frames that end each request, exactly one for every request. The handshake and the end of a session
// are session.h's; who is served next is the dispatcher's.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/net/asio.h"
#include "daemon/net/dispatcher.h"
#include "daemon/net/limits.h"
#include "daemon/net/mesh_source.h"
#include "daemon/net/open_meshes.h"
#include "proto/frame.h"
#include "proto/messages.h"
#include "proto/session.h"

namespace pmcd::net {

class SessionRequests {
 public:
  /// REQUIRES: all but `limits` outlive this object, which belongs to `session`.
  SessionRequests(Session& session, MeshSource& meshes, Dispatcher& dispatcher, const Limits& limits)
      : session_(session), source_(meshes), dispatcher_(dispatcher), meshes_(limits.meshes_per_session) {}
  SessionRequests(const SessionRequests&) = delete;
  SessionRequests& operator=(const SessionRequests&) = delete;

  /// A request, or a cancel, that the state of the session allows. The next frame is given when this has returned, so
  /// requests come into line in the order in which they were sent. May close the session.
  awaitable<void> on_frame(proto::FrameType type, proto::ByteView body);

  /// All chunks of a transfer are queued: its end goes behind them and the place moves.
  void transfer_complete(const Transfer& transfer);
  /// No further chunk of it will be queued: its end goes behind those that were; the place stays.
  void transfer_cancelled(const Transfer& transfer);
  /// It cannot be sent, or not further. The requests behind it in the line of its mesh end too.
  void transfer_failed(const Transfer& transfer, const store::Error& error);

  /// For a transfer whose mesh is gone: where the same content is stored by now, which the handle then holds; none if
  /// nowhere. REQUIRES: the session is alive until the end.
  awaitable<std::optional<store::MeshId>> stored_anew(OpenMeshes::Handle handle);

  /// The mesh was replaced or removed; its packets can be read for `grace` more.
  void mesh_retired(store::MeshId mesh, Duration grace);

  /// The mesh that was asked for last; nullptr if none was.
  [[nodiscard]] const OpenMesh* last_mesh() const { return meshes_.find(meshes_.last()); }

  /// The session is closed: nothing is sent any more, and the meshes are let go.
  void clear();

 private:
  void list_meshes(proto::GetMeshList message);
  awaitable<void> open_mesh(proto::GetBaseMesh message);
  awaitable<void> get_packet(proto::GetPacket message);
  void next_packet(const proto::GetNextPacket& message);
  void cancel(std::uint32_t id);

  /// Counts a request as open. False if it was refused, or the session closed because of it.
  bool admit(std::uint32_t id);
  /// The message, or none, and then the session is closed.
  template <typename M>
  std::optional<M> read(proto::ByteView body);
  /// Gives a mesh that was found a handle and tells it; 0 if the request was refused.
  OpenMeshes::Handle announce(std::uint32_t id, const SharedMesh& mesh, std::uint32_t place);
  void line_up(OpenMeshes::Handle handle, const Ask& ask);
  /// Hands the first request in the line of a mesh to the dispatcher, unless one is there already.
  void advance(OpenMeshes::Handle handle);
  /// A transfer that was with the dispatcher is over; `transfer_end` is queued.
  void over(const Transfer& transfer);
  void end(std::uint32_t id, proto::TransferResult result, proto::ErrorCode code = proto::ErrorCode::none);
  void refuse(std::uint32_t id, proto::ErrorCode code, std::string_view text);
  void log_unreadable(const std::string& what, const store::Error& error);
  void refuse_unreadable(std::uint32_t id, const std::string& what, const store::Error& error);

  Session& session_;
  MeshSource& source_;
  Dispatcher& dispatcher_;
  proto::OpenRequests open_;
  OpenMeshes meshes_;
  std::map<std::uint32_t, scheduler::RequestKey> lists_;  ///< mesh lists that are with the dispatcher, by id
};

}  // namespace pmcd::net
