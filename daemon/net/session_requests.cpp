// SPDX-License-Identifier: MIT
// Requests and what becomes of them.
#include "daemon/net/session_requests.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/net/session.h"
#include "proto/text.h"

namespace pmcd::net {

using proto::ErrorCode;
using proto::FrameType;

awaitable<void> SessionRequests::on_frame(FrameType type, proto::ByteView body) {
  if (type == FrameType::get_mesh_list) {
    auto message = read<proto::GetMeshList>(body);
    if (message && admit(message->id)) list_meshes(std::move(*message));
  } else if (type == FrameType::get_base_mesh) {
    auto message = read<proto::GetBaseMesh>(body);
    if (message && admit(message->id)) co_await open_mesh(std::move(*message));
  } else if (type == FrameType::get_next_packet) {
    const auto message = read<proto::GetNextPacket>(body);
    if (message && admit(message->id)) next_packet(*message);
  } else if (type == FrameType::get_packet) {
    const auto message = read<proto::GetPacket>(body);
    if (message && admit(message->id)) co_await get_packet(*message);
  } else if (type == FrameType::cancel) {
    if (const auto message = read<proto::Cancel>(body)) cancel(message->id);
  }
}

template <typename M>
std::optional<M> SessionRequests::read(proto::ByteView body) {
  auto message = proto::decode<M>(body);
  if (message) return std::move(message).value();
  session_.close(message.error().code, message.error().detail);
  return std::nullopt;
}

bool SessionRequests::admit(std::uint32_t id) {
  const ErrorCode code = open_.open(id);
  if (code == ErrorCode::none) return true;
  if (code == ErrorCode::too_many_requests) {
    // Its id is not among the open ones, so refuse(), which ends an open request, would be wrong here.
    session_.send_error(id, code, "at most " + std::to_string(proto::kMaxOpenRequests) + " requests may be open");
  } else {
    session_.close(code, "request id " + std::to_string(id) + " cannot be used");
  }
  return false;
}

void SessionRequests::list_meshes(proto::GetMeshList message) {
  // The page is made when its turn comes; until then the rules go by what it will be at most, so that who lists all the
  // time gains nothing by it.
  const std::uint64_t bytes = source_.mesh_list_bytes(message.most);
  const std::uint32_t id = message.id;
  Transfer transfer;
  transfer.session = session_.shared_from_this();
  transfer.id = id;
  transfer.list = std::move(message);
  lists_[id] = dispatcher_.enqueue(std::move(transfer), bytes, Clock::now());
}

awaitable<void> SessionRequests::open_mesh(proto::GetBaseMesh message) {
  const Clock::time_point asked_at = Clock::now();
  if (!proto::is_mesh_name(message.name)) {
    refuse(message.id, ErrorCode::bad_name, "this is no mesh name");
    co_return;
  }
  const auto found = co_await source_.find(message.name);
  if (session_.closed()) co_return;
  if (!found && found.error().code == store::ErrorCode::unknown_mesh) {
    refuse(message.id, ErrorCode::unknown_mesh, found.error().detail);
  } else if (!found) {
    refuse_unreadable(message.id, "\"" + message.name + "\"", found.error());
  } else if (const auto handle = announce(message.id, found.value(), 0); handle != 0) {
    line_up(handle, {message.id, Ask::Kind::base, 0, 0, asked_at});
  }
}

void SessionRequests::next_packet(const proto::GetNextPacket& message) {
  const OpenMeshes::Handle handle = message.handle == 0 ? meshes_.last() : message.handle;
  const OpenMesh* open = meshes_.find(handle);
  if (open == nullptr) {
    refuse(message.id, ErrorCode::unknown_handle, "no mesh of this handle was opened in this session");
  } else if (open->dead != ErrorCode::none) {
    refuse(message.id, open->dead, "the handle is of no use any more; open the mesh again");
  } else {
    line_up(handle, {message.id, Ask::Kind::next, 0, 0, Clock::now()});
  }
}

awaitable<void> SessionRequests::get_packet(proto::GetPacket message) {
  const Clock::time_point asked_at = Clock::now();
  OpenMeshes::Handle handle = meshes_.of_generation(message.generation);
  SharedMesh mesh;
  if (handle != 0) {
    mesh = meshes_.find(handle)->mesh;
  } else {
    const auto found = co_await source_.find_generation(message.generation);
    if (session_.closed()) co_return;
    if (!found && found.error().code == store::ErrorCode::unknown_mesh) {
      refuse(message.id, ErrorCode::mesh_changed, "there is no mesh of this content any more");
      co_return;
    }
    if (!found) {
      refuse_unreadable(message.id, "that was asked for by its generation", found.error());
      co_return;
    }
    mesh = found.value();
  }
  const auto& levels = mesh->mesh.levels;
  if (message.packet >= levels.size() || message.offset >= levels[message.packet].bytes) {
    refuse(message.id, ErrorCode::bad_range,
           message.packet >= levels.size()
               ? "the mesh has the packets 0 to " + std::to_string(levels.size() - 1)
               : "the packet has " + std::to_string(levels[message.packet].bytes) + " bytes");
    co_return;
  }
  if (handle == 0) handle = announce(message.id, mesh, message.packet);
  if (handle != 0) line_up(handle, {message.id, Ask::Kind::exact, message.packet, message.offset, asked_at});
}

OpenMeshes::Handle SessionRequests::announce(std::uint32_t id, const SharedMesh& mesh, std::uint32_t place) {
  const OpenMeshes::Handle handle = meshes_.open(mesh, place);
  if (handle == 0) {
    refuse(id, ErrorCode::too_many_requests, "the session has opened too many meshes");
    return 0;
  }
  session_.send(proto::encode(proto::MeshOpened{id, handle, mesh->mesh.summary.generation, mesh->directory}));
  return handle;
}

void SessionRequests::line_up(OpenMeshes::Handle handle, const Ask& ask) {
  meshes_.set_last(handle);
  meshes_.find(handle)->line.push_back(ask);
  advance(handle);
}

void SessionRequests::advance(OpenMeshes::Handle handle) {
  OpenMesh& open = *meshes_.find(handle);
  const store::Mesh& mesh = open.mesh->mesh;
  while (!open.busy && !open.line.empty()) {
    const Ask ask = open.line.front();
    const std::uint32_t packet = ask.kind == Ask::Kind::next ? open.place : ask.packet;
    if (packet < mesh.levels.size()) {
      Transfer transfer;
      transfer.session = session_.shared_from_this();
      transfer.id = ask.id;
      transfer.handle = handle;
      transfer.packet = packet;
      transfer.offset = ask.offset;
      transfer.mesh = mesh.summary.id;
      transfer.of = open.mesh;
      open.busy = dispatcher_.enqueue(std::move(transfer), mesh.levels[packet].bytes, ask.at);
      return;
    }
    open.line.erase(open.line.begin());
    end(ask.id, proto::TransferResult::end_of_mesh);
    if (session_.closed()) return;
  }
}

void SessionRequests::cancel(std::uint32_t id) {
  if (!open_.is_open(id)) return;  // it crossed the end of the request
  if (const auto list = lists_.find(id); list != lists_.end()) {
    dispatcher_.cancel(list->second);
    return;
  }
  const OpenMeshes::Handle handle = meshes_.line_of(id);
  if (handle == 0) return;
  OpenMesh& open = *meshes_.find(handle);
  if (open.busy && open.line.front().id == id) {
    dispatcher_.cancel(*open.busy);
    return;
  }
  std::erase_if(open.line, [id](const Ask& ask) { return ask.id == id; });
  end(id, proto::TransferResult::cancelled);
}

awaitable<std::optional<store::MeshId>> SessionRequests::stored_anew(OpenMeshes::Handle handle) {
  const auto found = co_await source_.find_generation(meshes_.find(handle)->mesh->mesh.summary.generation);
  OpenMesh* open = meshes_.find(handle);
  if (!found || open == nullptr) co_return std::nullopt;
  open->mesh = found.value();
  co_return found.value()->mesh.summary.id;
}

void SessionRequests::transfer_complete(const Transfer& transfer) {
  if (OpenMesh* open = meshes_.find(transfer.handle)) open->place = transfer.packet + 1;
  end(transfer.id, proto::TransferResult::complete);
  over(transfer);
}

void SessionRequests::transfer_cancelled(const Transfer& transfer) {
  end(transfer.id, proto::TransferResult::cancelled);
  over(transfer);
}

void SessionRequests::over(const Transfer& transfer) {
  if (session_.closed()) return;
  lists_.erase(transfer.id);
  OpenMesh* open = meshes_.find(transfer.handle);
  if (open == nullptr) return;  // a mesh list
  open->line.erase(open->line.begin());
  open->busy.reset();
  advance(transfer.handle);
}

void SessionRequests::transfer_failed(const Transfer& transfer, const store::Error& error) {
  if (transfer.list) {
    log_unreadable("mesh list", error);
    lists_.erase(transfer.id);
    refuse(transfer.id, ErrorCode::internal_error, "the mesh list cannot be read at present");
    return;
  }
  const bool gone = error.code == store::ErrorCode::unknown_mesh;
  const ErrorCode code = gone ? ErrorCode::mesh_changed : ErrorCode::unavailable;
  OpenMesh& open = *meshes_.find(transfer.handle);
  if (!gone) {
    log_unreadable("mesh \"" + open.mesh->mesh.summary.name + "\", packet " + std::to_string(transfer.packet), error);
  }
  open.dead = code;
  open.busy.reset();
  for (const Ask& ask : std::exchange(open.line, {})) {
    // What has chunks on the data channel ends behind them.
    if (transfer.begun && ask.id == transfer.id) {
      end(ask.id, proto::TransferResult::failed, code);
      if (session_.closed()) return;
      continue;
    }
    refuse(ask.id, code, gone ? "the mesh was replaced or removed" : "the mesh cannot be read at present");
  }
}

void SessionRequests::mesh_retired(store::MeshId mesh, Duration grace) {
  for (const OpenMeshes::Handle handle : meshes_.of_mesh(mesh)) {
    proto::Notice notice;
    notice.kind = proto::NoticeKind::mesh_retired;
    notice.handle = handle;
    notice.seconds = static_cast<std::uint32_t>(std::chrono::floor<std::chrono::seconds>(grace).count());
    notice.text = "\"" + meshes_.find(handle)->mesh->mesh.summary.name + "\" was replaced or removed";
    session_.send(proto::encode(notice));
  }
}

void SessionRequests::clear() {
  meshes_.clear();
  lists_.clear();
}

void SessionRequests::end(std::uint32_t id, proto::TransferResult result, ErrorCode code) {
  open_.end(id);
  session_.send_on_data(proto::encode(proto::TransferEnd{id, result, code}));
}

void SessionRequests::refuse(std::uint32_t id, ErrorCode code, std::string_view text) {
  open_.end(id);
  session_.send_error(id, code, text);
}

void SessionRequests::log_unreadable(const std::string& what, const store::Error& error) {
  if (session_.may_log_damage()) spdlog::error("{}: {}: {}", what, store::error_name(error.code), error.detail);
}

void SessionRequests::refuse_unreadable(std::uint32_t id, const std::string& what, const store::Error& error) {
  log_unreadable("mesh " + what, error);
  refuse(id, ErrorCode::unavailable, "the mesh cannot be read at present");
}

}  // namespace pmcd::net
