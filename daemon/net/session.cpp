// SPDX-License-Identifier: MIT
// What a client's frames lead to, and how a session ends.
#include "daemon/net/session.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "proto/messages.h"
#include "proto/text.h"

namespace pmcd::net {

using proto::ErrorCode;
using proto::FrameType;

Session::Session(std::uint64_t key, std::string peer, std::shared_ptr<Channel> requests, SessionContext& context)
    : key_(key), peer_(std::move(peer)), requests_(std::move(requests)), context_(context) {}

awaitable<void> Session::run([[maybe_unused]] std::shared_ptr<Session> self) {
  if (co_await greet()) {
    while (!closed_) {
      if (!co_await requests_->room()) {
        close(ErrorCode::stalled, "the request channel does not take its answers");
        break;
      }
      const Channel::Incoming incoming = co_await requests_->read(deadline_);
      if (std::holds_alternative<Channel::Closed>(incoming)) {
        close(ErrorCode::none, "the request channel ended");
      } else if (std::holds_alternative<Channel::TimedOut>(incoming)) {
        if (state_ != proto::SessionState::joined) close(ErrorCode::join_timeout, "no data channel joined in time");
      } else if (const auto* error = std::get_if<proto::Error>(&incoming)) {
        close(error->code, error->detail);
      } else if (!co_await on_frame(std::get<proto::Frame>(incoming))) {
        break;
      }
    }
  }
  close(ErrorCode::none, "ended");
  co_await requests_->finish();
}

awaitable<bool> Session::greet() {
  const Channel::Incoming incoming = co_await requests_->read(Clock::now() + context_.limits.hello);
  if (std::holds_alternative<Channel::Closed>(incoming)) {
    close(ErrorCode::none, "left before hello");
    co_return false;
  }
  if (std::holds_alternative<Channel::TimedOut>(incoming)) {
    close(ErrorCode::hello_timeout, "no hello came in time");
    co_return false;
  }
  if (const auto* error = std::get_if<proto::Error>(&incoming)) {
    close(error->code, error->detail);
    co_return false;
  }
  co_return on_hello(std::get<proto::Frame>(incoming));
}

bool Session::on_hello(const proto::Frame& frame) {
  const ErrorCode allowed = proto::check_client_frame(proto::Channel::request, state_, frame.type);
  if (allowed != ErrorCode::none) {
    close(allowed, "the first frame must be hello");
    return false;
  }
  const auto hello = proto::decode<proto::Hello>(frame.body);
  if (!hello) {
    close(hello.error().code, hello.error().detail);
    return false;
  }
  if (context_.draining) {
    close(ErrorCode::shutting_down, "the daemon is ending");
    return false;
  }
  const auto token = context_.tokens.issue(shared_from_this());
  if (!token) {
    close(ErrorCode::internal_error, "no token could be made");
    return false;
  }
  token_ = *token;
  proto::HelloOk answer;
  answer.token = token_;
  answer.data_port = context_.data_port;
  answer.join_seconds =
      static_cast<std::uint16_t>(std::chrono::ceil<std::chrono::seconds>(context_.limits.join).count());
  answer.agent = context_.agent;
  requests_->send(proto::encode(answer));
  state_ = proto::SessionState::greeted;
  deadline_ = Clock::now() + context_.limits.join;
  spdlog::info("session {} from {}: hello from \"{}\"", key_, peer_, hello.value().agent);
  return true;
}

awaitable<void> Session::run_data(std::shared_ptr<Channel> data) {
  const auto self = shared_from_this();
  data_ = std::move(data);
  state_ = proto::SessionState::joined;
  deadline_.reset();
  requests_->lift_deadline();
  data_->send(proto::encode(proto::JoinOk{}));
  while (!closed_) {
    const Channel::Incoming incoming = co_await data_->read();
    if (std::holds_alternative<Channel::Closed>(incoming)) {
      close(ErrorCode::channel_lost, "the data channel was lost");
    } else if (const auto* error = std::get_if<proto::Error>(&incoming)) {
      send_error(*data_, 0, error->code, error->detail);
      close(ErrorCode::channel_lost, "the data channel sent what is no frame");
    } else if (const auto* frame = std::get_if<proto::Frame>(&incoming)) {
      const ErrorCode code = proto::check_client_frame(proto::Channel::data, state_, frame->type);
      send_error(*data_, code == ErrorCode::unknown_type ? proto::peek_id(frame->body) : 0, code,
                 "nothing is expected on the data channel after join");
      if (proto::code_ends(code) == proto::Ends::session) {
        close(ErrorCode::channel_lost, "the data channel sent a frame that belongs elsewhere");
      } else {
        data_keeps_up();
      }
    }
  }
  co_await data_->finish();
}

bool Session::data_keeps_up() {
  if (data_->queued_frames() <= context_.limits.queued_frames) return true;
  close(ErrorCode::stalled, "the data channel does not take its answers");
  return false;
}

void Session::close(ErrorCode code, std::string_view why) {
  if (closed_) return;
  closed_ = true;
  spdlog::info("session {} from {}: closed: {}{}{}", key_, peer_, code == ErrorCode::none ? "" : proto::code_name(code),
               code == ErrorCode::none ? "" : ": ", why);
  context_.tokens.revoke(token_);
  if (code != ErrorCode::none) send_error(*requests_, 0, code, why);
  requests_->stop_reading();
  if (data_ && code == ErrorCode::stalled) {
    data_->abort();
  } else if (data_) {
    data_->stop_reading();
  }
  context_.dispatcher.session_gone(key_);
  meshes_.clear();
}

awaitable<bool> Session::on_frame(const proto::Frame& frame) {
  const ErrorCode allowed = proto::check_client_frame(proto::Channel::request, state_, frame.type);
  if (allowed != ErrorCode::none) {
    const char* const name = proto::type_name(frame.type);
    const std::string text = name != nullptr ? std::string(name) + " is not allowed now"
                                             : "frame type " + std::to_string(frame.type) + " is not known";
    if (proto::code_ends(allowed) == proto::Ends::session) {
      close(allowed, text);
      co_return false;
    }
    send_error(*requests_, proto::peek_id(frame.body), allowed, text);
    co_return true;
  }
  const auto type = static_cast<FrameType>(frame.type);
  if (type == FrameType::goodbye) {
    const auto goodbye = proto::decode<proto::Goodbye>(frame.body);
    close(goodbye ? ErrorCode::none : goodbye.error().code, goodbye ? "goodbye" : goodbye.error().detail);
    co_return false;
  }
  if (type == FrameType::ping) {
    const auto ping = proto::decode<proto::Ping>(frame.body);
    if (!ping) {
      close(ping.error().code, ping.error().detail);
      co_return false;
    }
    requests_->send(proto::encode(proto::Pong{ping.value().id}));
    co_return true;
  }
  co_return co_await on_request(type, frame.body);
}

awaitable<bool> Session::on_request(FrameType type, proto::ByteView body) {
  std::uint32_t id = 0;
  std::uint32_t handle = 0;
  std::string name;
  std::optional<proto::Error> error;
  if (type == FrameType::get_mesh_list) {
    const auto message = proto::decode<proto::GetMeshList>(body);
    message ? static_cast<void>(id = message.value().id) : static_cast<void>(error = message.error());
  } else if (type == FrameType::get_base_mesh) {
    auto message = proto::decode<proto::GetBaseMesh>(body);
    if (message) {
      id = message.value().id;
      name = std::move(message.value().name);
    } else {
      error = message.error();
    }
  } else {
    const auto message = proto::decode<proto::GetNextPacket>(body);
    if (message) {
      id = message.value().id;
      handle = message.value().handle;
    } else {
      error = message.error();
    }
  }
  if (error) {
    close(error->code, error->detail);
    co_return false;
  }
  const ErrorCode opened = open_.open(id);
  if (opened == ErrorCode::too_many_requests) {
    // Its id is not among the open ones, so refuse(), which ends an open request, would be wrong here.
    send_error(*requests_, id, opened, "at most " + std::to_string(proto::kMaxOpenRequests) + " requests may be open");
    co_return true;
  }
  if (opened != ErrorCode::none) {
    close(opened, "request id " + std::to_string(id) + " cannot be used");
    co_return false;
  }
  if (type == FrameType::get_mesh_list) {
    co_await list_meshes(id);
  } else if (type == FrameType::get_base_mesh) {
    co_await open_mesh(id, std::move(name));
  } else {
    next_packet(id, handle);
  }
  co_return !closed_;
}

awaitable<void> Session::list_meshes(std::uint32_t id) {
  const Clock::time_point asked_at = Clock::now();
  const auto list = co_await context_.catalog.mesh_list();
  if (closed_) co_return;
  if (!list) {
    spdlog::error("session {}: mesh list: {}: {}", key_, store::error_name(list.error().code), list.error().detail);
    refuse(id, ErrorCode::internal_error, "the mesh list cannot be read at present");
    co_return;
  }
  context_.dispatcher.enqueue({shared_from_this(), id, 0, 0, 0, list.value()}, list.value()->size(), asked_at);
}

awaitable<void> Session::open_mesh(std::uint32_t id, std::string name) {
  const Clock::time_point asked_at = Clock::now();
  if (!proto::is_mesh_name(name)) {
    refuse(id, ErrorCode::bad_name, "this is no mesh name");
    co_return;
  }
  const auto found = co_await context_.catalog.find(name);
  if (closed_) co_return;
  if (!found && found.error().code == store::ErrorCode::unknown_mesh) {
    refuse(id, ErrorCode::unknown_mesh, found.error().detail);
    co_return;
  }
  if (!found) {
    spdlog::error("mesh \"{}\": {}: {}", name, store::error_name(found.error().code), found.error().detail);
    refuse(id, ErrorCode::unavailable, "the mesh cannot be read at present");
    co_return;
  }
  const std::uint32_t handle = handle_of(found.value());
  if (handle == 0) {
    refuse(id, ErrorCode::too_many_requests, "the session has opened too many meshes");
    co_return;
  }
  last_handle_ = handle;
  const CatalogMesh& mesh = *found.value();
  requests_->send(proto::encode(proto::MeshOpened{id, handle, mesh.mesh.summary.generation, mesh.directory}));
  meshes_.at(handle).line.push_back({id, true, asked_at});
  advance(handle);
}

void Session::next_packet(std::uint32_t id, std::uint32_t handle) {
  if (handle == 0) handle = last_handle_;
  const auto it = meshes_.find(handle);
  if (it == meshes_.end()) {
    refuse(id, ErrorCode::unknown_handle, "no mesh of this handle was opened in this session");
    return;
  }
  if (it->second.dead != ErrorCode::none) {
    refuse(id, it->second.dead, "the handle is of no use any more; open the mesh again");
    return;
  }
  last_handle_ = handle;
  it->second.line.push_back({id, false, Clock::now()});
  advance(handle);
}

std::uint32_t Session::handle_of(const std::shared_ptr<const CatalogMesh>& mesh) {
  const store::MeshSummary& wanted = mesh->mesh.summary;
  for (auto& [handle, open] : meshes_) {
    const store::MeshSummary& summary = open.mesh->mesh.summary;
    if (open.dead == ErrorCode::none && summary.name == wanted.name && summary.generation == wanted.generation) {
      open.mesh = mesh;  // the same content, perhaps stored anew under another id
      return handle;
    }
  }
  if (meshes_.size() >= context_.limits.meshes_per_session) {
    std::erase_if(meshes_, [](const auto& entry) { return entry.second.dead != ErrorCode::none; });
  }
  if (meshes_.size() >= context_.limits.meshes_per_session) return 0;
  OpenMesh open;
  open.mesh = mesh;
  const std::uint32_t handle = next_handle_++;
  meshes_.emplace(handle, std::move(open));
  return handle;
}

void Session::advance(std::uint32_t handle) {
  OpenMesh& open = meshes_.at(handle);
  const store::Mesh& mesh = open.mesh->mesh;
  while (!open.busy && !open.line.empty()) {
    const Ask ask = open.line.front();
    if (ask.base) open.place = 0;
    const std::uint32_t packet = open.place;
    if (packet < mesh.levels.size()) {
      open.busy = true;
      context_.dispatcher.enqueue({shared_from_this(), ask.id, handle, packet, mesh.summary.id, nullptr},
                                  mesh.levels[packet].bytes, ask.at);
      return;
    }
    open.line.pop_front();
    open_.end(ask.id);
    data_->send(proto::encode(proto::TransferEnd{ask.id, proto::TransferResult::end_of_mesh, ErrorCode::none}));
    if (!data_keeps_up()) return;
  }
}

void Session::transfer_sent(const Transfer& transfer) {
  data_->send(proto::encode(proto::TransferEnd{transfer.id, proto::TransferResult::complete, ErrorCode::none}));
  open_.end(transfer.id);
  const auto it = meshes_.find(transfer.handle);
  if (it == meshes_.end()) return;  // a mesh list
  it->second.place = transfer.packet + 1;
  it->second.line.pop_front();
  it->second.busy = false;
  advance(transfer.handle);
}

void Session::transfer_failed(const Transfer& transfer, const store::Error& error) {
  const bool gone = error.code == store::ErrorCode::unknown_mesh;
  const ErrorCode code = gone ? ErrorCode::mesh_changed : ErrorCode::unavailable;
  OpenMesh& open = meshes_.at(transfer.handle);
  if (!gone) {
    spdlog::error("mesh \"{}\", packet {}: {}: {}", open.mesh->mesh.summary.name, transfer.packet,
                  store::error_name(error.code), error.detail);
  }
  open.dead = code;
  open.busy = false;
  for (const Ask& ask : std::exchange(open.line, {})) {
    refuse(ask.id, code, gone ? "the mesh was replaced or removed" : "the mesh cannot be read at present");
  }
}

void Session::refuse(std::uint32_t id, ErrorCode code, std::string_view text) {
  open_.end(id);
  send_error(*requests_, id, code, text);
}

void Session::send_error(Channel& channel, std::uint32_t id, ErrorCode code, std::string_view text) {
  proto::ErrorMessage message;
  message.id = id;
  message.code = code;
  message.text = proto::printable(text, proto::kMaxErrorTextBytes);
  channel.send(proto::encode(message));
}

}  // namespace pmcd::net
