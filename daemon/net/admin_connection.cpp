// SPDX-License-Identifier: MIT
// The commands of the admin channel.
#include "daemon/net/admin_connection.h"

#include <spdlog/spdlog.h>

#include <cstddef>
#include <utility>

#include "proto/text.h"

namespace pmcd::net {

using proto::ErrorCode;
using proto::FrameType;

namespace {

std::string identity_text(const std::optional<PeerIdentity>& peer) {
  if (!peer) return "uid ? pid ?";
  return "uid " + std::to_string(peer->uid) + " pid " + std::to_string(peer->pid);
}

ErrorCode wire_code(store::ErrorCode code) {
  switch (code) {
    case store::ErrorCode::unknown_mesh:
      return ErrorCode::unknown_mesh;
    case store::ErrorCode::name_taken:
      return ErrorCode::mesh_exists;
    case store::ErrorCode::bad_name:
      return ErrorCode::bad_name;
    case store::ErrorCode::bad_directory:
      return ErrorCode::bad_directory;
    case store::ErrorCode::bad_packet:
      return ErrorCode::bad_packet;
    case store::ErrorCode::incomplete:
      return ErrorCode::ingest_incomplete;
    case store::ErrorCode::too_large:
      return ErrorCode::too_large;
    default:
      return ErrorCode::storage_failed;
  }
}

}  // namespace

AdminConnection::AdminConnection(std::shared_ptr<Channel> channel, std::optional<PeerIdentity> peer,
                                 AdminContext& context)
    : channel_(std::move(channel)),
      peer_(peer.value_or(PeerIdentity{static_cast<uid_t>(-1), 0})),
      who_(identity_text(peer)),
      context_(context) {}

awaitable<void> AdminConnection::run([[maybe_unused]] std::shared_ptr<AdminConnection> self) {
  bool go_on = true;
  while (go_on) {
    if (!co_await channel_->room()) break;
    const bool fresh = state_ == proto::SessionState::fresh;
    const auto limit = fresh ? context_.limits.hello : context_.limits.admin_idle;
    const Channel::Incoming incoming = co_await channel_->read(Clock::now() + limit);
    if (std::holds_alternative<Channel::Closed>(incoming)) {
      break;
    }
    if (std::holds_alternative<Channel::TimedOut>(incoming)) {
      go_on = fresh ? end_with(ErrorCode::hello_timeout, "no hello came in time")
                    : end_with(ErrorCode::stalled, "nothing came for too long");
    } else if (const auto* error = std::get_if<proto::Error>(&incoming)) {
      go_on = end_with(error->code, error->detail);
    } else if (fresh) {
      go_on = on_hello(std::get<proto::Frame>(incoming));
    } else {
      go_on = co_await on_frame(std::get<proto::Frame>(incoming));
    }
  }
  if (ingest_ && ingest_->upload) log("ingest", ingest_->name, "given up: the connection ended before commit");
  ingest_.reset();
  co_await channel_->finish();
}

bool AdminConnection::on_hello(const proto::Frame& frame) {
  const ErrorCode allowed = proto::check_client_frame(proto::Channel::admin, state_, frame.type);
  if (allowed != ErrorCode::none) return end_with(allowed, "the first frame must be admin_hello");
  const auto hello = proto::decode<proto::AdminHello>(frame.body);
  if (!hello) return end_with(hello.error().code, hello.error().detail);
  proto::AdminHelloOk answer;
  answer.agent = context_.agent;
  channel_->send(proto::encode(answer));
  state_ = proto::SessionState::joined;
  return true;
}

awaitable<bool> AdminConnection::on_frame(const proto::Frame& frame) {
  const ErrorCode allowed = proto::check_client_frame(proto::Channel::admin, state_, frame.type);
  if (allowed != ErrorCode::none) {
    const std::string text = "frame type " + std::to_string(frame.type) + " is not known or not allowed here";
    if (proto::code_ends(allowed) == proto::Ends::session) co_return end_with(allowed, text);
    send_error(proto::peek_id(frame.body), allowed, text);
    co_return true;
  }
  co_return co_await on_command(static_cast<FrameType>(frame.type), frame.body);
}

awaitable<bool> AdminConnection::on_command(FrameType type, proto::ByteView body) {
  // Every command is decoded alike: a body that has not its form ends the connection.
  const auto malformed = [this](const auto& message) { return end_with(message.error().code, message.error().detail); };
  switch (type) {
    case FrameType::goodbye:
      co_return false;
    case FrameType::ping: {
      const auto message = proto::decode<proto::Ping>(body);
      if (!message) co_return malformed(message);
      channel_->send(proto::encode(proto::Pong{message.value().id}));
      co_return true;
    }
    case FrameType::admin_list: {
      const auto message = proto::decode<proto::AdminList>(body);
      if (!message) co_return malformed(message);
      co_await list(message.value().id);
      co_return true;
    }
    case FrameType::admin_show: {
      const auto message = proto::decode<proto::AdminShow>(body);
      if (!message) co_return malformed(message);
      co_await show(message.value().id, message.value().name);
      co_return true;
    }
    case FrameType::admin_remove: {
      const auto message = proto::decode<proto::AdminRemove>(body);
      if (!message) co_return malformed(message);
      co_await remove(message.value().id, message.value().name);
      co_return true;
    }
    case FrameType::admin_status: {
      const auto message = proto::decode<proto::AdminStatus>(body);
      if (!message) co_return malformed(message);
      co_await status(message.value().id);
      co_return true;
    }
    case FrameType::ingest_begin: {
      auto message = proto::decode<proto::IngestBegin>(body);
      if (!message) co_return malformed(message);
      co_return co_await ingest_begin(std::move(message).value());
    }
    case FrameType::ingest_data: {
      const auto message = proto::decode_ingest_data(body);
      if (!message) co_return malformed(message);
      co_return co_await ingest_data(message.value());
    }
    case FrameType::ingest_commit: {
      const auto message = proto::decode<proto::IngestCommit>(body);
      if (!message) co_return malformed(message);
      co_return co_await ingest_commit(message.value().id);
    }
    default:
      co_return co_await rule_command(type, body);
  }
}

awaitable<bool> AdminConnection::rule_command(FrameType type, proto::ByteView body) {
  const auto outcome = co_await context_.rules.answer(type, body, peer_);
  if (!outcome) co_return end_with(ErrorCode::wrong_state, "this frame is not for the admin channel");
  if (const auto* error = std::get_if<proto::Error>(&*outcome)) co_return end_with(error->code, error->detail);
  const auto& given = std::get<RuleCommands::Answer>(*outcome);
  if (given.code != ErrorCode::none) {
    log(given.command, "", "refused: " + given.text);
    send_error(given.id, given.code, given.text);
    co_return true;
  }
  // Looks at the queue come every second from whoever watches; they change nothing and fill no log.
  if (given.changes) log(given.command, "", given.about);
  auto frames = proto::encode_answer(given.id, given.json);
  co_await answer(std::move(frames));
  co_return true;
}

awaitable<void> AdminConnection::list(std::uint32_t id) {
  const auto make = [id](const store::MeshList& list) { return proto::encode_answer(id, list_json(list)); };
  auto frames = co_await context_.catalog.summarize(make);
  log("list", "", frames ? "done" : frames.error().detail);
  if (!frames) {
    refuse(id, frames.error());
    co_return;
  }
  co_await answer(std::move(frames).value());
}

awaitable<void> AdminConnection::show(std::uint32_t id, std::string name) {
  const auto found = co_await context_.catalog.find(name);
  log("show", name, found ? "done" : found.error().detail);
  if (!found) {
    refuse(id, found.error());
    co_return;
  }
  co_await answer(proto::encode_answer(id, show_json(found.value()->mesh)));
}

awaitable<void> AdminConnection::remove(std::uint32_t id, std::string name) {
  const auto removed = co_await context_.catalog.remove(name);
  log("remove", name, removed ? "done" : removed.error().detail);
  if (!removed) {
    refuse(id, removed.error());
    co_return;
  }
  co_await answer(proto::encode_answer(id, removed_json(name, removed.value().generation)));
}

awaitable<void> AdminConnection::status(std::uint32_t id) {
  struct Counts {
    std::size_t meshes = 0;
    std::size_t damaged = 0;
  };
  const auto count = [](const store::MeshList& list) { return Counts{list.meshes.size(), list.damaged.size()}; };
  const auto counts = co_await context_.catalog.summarize(count);
  log("status", "", counts ? "done" : counts.error().detail);
  if (!counts) {
    refuse(id, counts.error());
    co_return;
  }
  StatusReport report = context_.status();
  report.meshes = counts.value().meshes;
  report.damaged_meshes = counts.value().damaged;
  co_await answer(proto::encode_answer(id, status_json(report)));
}

awaitable<bool> AdminConnection::ingest_begin(proto::IngestBegin message) {
  if (ingest_ && ingest_->upload) co_return end_with(ErrorCode::wrong_state, "an ingest is under way already");
  ingest_ = Ingest{message.id, message.name, nullptr};
  if (!proto::is_mesh_name(message.name)) {
    ingest_failed({store::ErrorCode::bad_name, "this is no mesh name"});
    co_return true;
  }
  auto begun = co_await context_.catalog.begin_upload(message.name, message.replace, std::move(message.directory));
  if (!begun) {
    ingest_failed(begun.error());
    co_return true;
  }
  ingest_->upload = std::move(begun).value();
  channel_->send(proto::encode(proto::IngestReady{message.id}));
  co_return true;
}

awaitable<bool> AdminConnection::ingest_data(proto::IngestDataView data) {
  if (!ingest_ || ingest_->id != data.header.id) {
    co_return end_with(ErrorCode::wrong_state, "ingest_data without an ingest of that id");
  }
  if (!ingest_->upload) co_return true;
  proto::Bytes bytes(data.bytes.begin(), data.bytes.end());
  const store::Status status =
      co_await context_.catalog.append(ingest_->upload, data.header.packet, data.header.offset, std::move(bytes));
  if (!status) ingest_failed(status.error());
  co_return true;
}

awaitable<bool> AdminConnection::ingest_commit(std::uint32_t id) {
  if (!ingest_ || ingest_->id != id) {
    co_return end_with(ErrorCode::wrong_state, "ingest_commit without an ingest of that id");
  }
  if (!ingest_->upload) co_return true;
  const auto inserted = co_await context_.catalog.commit(ingest_->upload);
  if (!inserted) {
    ingest_failed(inserted.error());
    co_return true;
  }
  const store::MeshSummary& mesh = inserted.value().mesh;
  log("ingest", mesh.name,
      "stored: " + std::to_string(mesh.packets) + " packets, " + std::to_string(mesh.bytes) + " bytes" +
          (inserted.value().replaced() ? ", in place of the mesh of that name" : ""));
  channel_->send(proto::encode(proto::IngestOk{id, mesh.generation, inserted.value().replaced()}));
  ingest_.reset();
  co_return true;
}

void AdminConnection::ingest_failed(const store::Error& error) {
  ingest_->upload.reset();
  log("ingest", ingest_->name, std::string("refused: ") + store::error_name(error.code) + ": " + error.detail);
  refuse(ingest_->id, error);
}

awaitable<void> AdminConnection::answer(std::vector<proto::Bytes> frames) {
  for (proto::Bytes& frame : frames) {
    if (!co_await channel_->room()) {
      channel_->stop_reading();  // half an answer is none: the connection ends
      co_return;
    }
    channel_->send(std::move(frame));
  }
}

void AdminConnection::refuse(std::uint32_t id, const store::Error& error) {
  send_error(id, wire_code(error.code), error.detail);
}

void AdminConnection::send_error(std::uint32_t id, ErrorCode code, std::string_view text) {
  proto::ErrorMessage message;
  message.id = id;
  message.code = code;
  message.text = proto::printable(text, proto::kMaxErrorTextBytes);
  channel_->send(proto::encode(message));
}

bool AdminConnection::end_with(ErrorCode code, std::string_view text) {
  spdlog::warn("admin {}: {}: {}", who_, proto::code_name(code), text);
  send_error(0, code, text);
  return false;
}

void AdminConnection::log(std::string_view command, std::string_view name, std::string_view result) const {
  const bool named = !name.empty();
  spdlog::info("admin {}: {}{}{}{}: {}", who_, command, named ? " \"" : "",
               proto::printable(name, proto::kMaxNameBytes), named ? "\"" : "",
               proto::printable(result, proto::kMaxErrorTextBytes));
}

}  // namespace pmcd::net
