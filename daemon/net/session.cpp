// SPDX-License-Identifier: MIT
// The handshake, the two reading loops, and the end of a session.
#include "daemon/net/session.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "proto/messages.h"
#include "proto/text.h"

namespace pmcd::net {

using proto::ErrorCode;
using proto::FrameType;

namespace {

proto::Bytes error_frame(std::uint32_t id, ErrorCode code, std::string_view text) {
  proto::ErrorMessage message;
  message.id = id;
  message.code = code;
  message.text = proto::printable(text, proto::kMaxErrorTextBytes);
  return proto::encode(message);
}

}  // namespace

Session::Session(std::uint64_t key, std::string peer, std::shared_ptr<Channel> requests, SessionContext& context)
    : key_(key),
      peer_(std::move(peer)),
      request_channel_(std::move(requests)),
      context_(context),
      requests_(*this, context.meshes, context.dispatcher, context.limits) {}

awaitable<void> Session::run([[maybe_unused]] std::shared_ptr<Session> self) {
  if (co_await greet()) {
    while (!closed_) {
      if (!request_channel_->has_room() && !co_await request_channel_->room()) {
        close(ErrorCode::stalled, "the request channel does not take its answers");
        break;
      }
      const Channel::Incoming incoming = co_await request_channel_->read(deadline_);
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
  co_await request_channel_->finish();
}

awaitable<bool> Session::greet() {
  const Channel::Incoming incoming = co_await request_channel_->read(Clock::now() + context_.limits.hello);
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
  send(proto::encode(answer));
  state_ = proto::SessionState::greeted;
  deadline_ = Clock::now() + context_.limits.join;
  if (context_.log.take()) spdlog::info("session {} from {}: hello from \"{}\"", key_, peer_, hello.value().agent);
  return true;
}

SessionView Session::view(Clock::time_point now) const {
  SessionView view;
  view.key = key_;
  view.address = peer_;
  view.connected_seconds = std::chrono::duration<double>(now - connected_at_).count();
  if (const OpenMesh* mesh = requests_.last_mesh()) {
    view.mesh = mesh->mesh->mesh.summary.name;
    view.level = mesh->place;
    view.levels = mesh->mesh->mesh.summary.packets;
  }
  return view;
}

awaitable<void> Session::run_data(std::shared_ptr<Channel> data) {
  const auto self = shared_from_this();
  data_ = std::move(data);
  state_ = proto::SessionState::joined;
  deadline_.reset();
  request_channel_->lift_deadline();
  data_->on_progress([dispatcher = &context_.dispatcher, key = key_] { dispatcher->progress(key); });
  data_->send(proto::encode(proto::JoinOk{}));
  while (!closed_) {
    const Channel::Incoming incoming = co_await data_->read();
    if (std::holds_alternative<Channel::Closed>(incoming)) {
      close(ErrorCode::channel_lost, "the data channel was lost");
    } else if (const auto* error = std::get_if<proto::Error>(&incoming)) {
      data_->send(error_frame(0, error->code, error->detail));
      close(ErrorCode::channel_lost, "the data channel sent what is no frame");
    } else if (const auto* frame = std::get_if<proto::Frame>(&incoming)) {
      on_data_frame(*frame);
    }
  }
  co_await data_->finish();
}

void Session::on_data_frame(const proto::Frame& frame) {
  const ErrorCode code = proto::check_client_frame(proto::Channel::data, state_, frame.type);
  const std::uint32_t id = code == ErrorCode::unknown_type ? proto::peek_id(frame.body) : 0;
  send_on_data(error_frame(id, code, "nothing is expected on the data channel after join"));
  if (proto::code_ends(code) == proto::Ends::session) {
    close(ErrorCode::channel_lost, "the data channel sent a frame that belongs elsewhere");
  }
}

void Session::send(proto::Bytes frame) {
  request_channel_->send(std::move(frame));
  if (answers_watched_ || closed_) return;
  answers_watched_ = true;
  context_.answers.add(weak_from_this());
}

bool Session::owes_answers(Clock::time_point now) {
  if (closed_) return false;
  if (request_channel_->owed_for(now) >= context_.limits.stall) {
    close(ErrorCode::stalled, "the request channel does not take its answers");
    return false;
  }
  answers_watched_ = request_channel_->last_acknowledged() < request_channel_->queued_position();
  return answers_watched_;
}

void Session::send_on_data(proto::Bytes frame) {
  data_->send(std::move(frame));
  if (data_->queued_frames() <= context_.limits.queued_frames) return;
  close(ErrorCode::stalled, "the data channel does not take its answers");
}

void Session::send_error(std::uint32_t id, ErrorCode code, std::string_view text) {
  send(error_frame(id, code, text));
}

void Session::close(ErrorCode code, std::string_view why) {
  if (closed_) return;
  closed_ = true;
  if (std::exchange(answers_watched_, false)) context_.answers.closed();
  // A client that was dropped because it held up the others is always told of: there cannot be many.
  if (code == ErrorCode::stalled || context_.log.take()) {
    spdlog::info("session {} from {}: closed: {}{}{}", key_, peer_,
                 code == ErrorCode::none ? "" : proto::code_name(code), code == ErrorCode::none ? "" : ": ", why);
  }
  context_.tokens.revoke(token_);
  if (code != ErrorCode::none) send_error(0, code, why);
  request_channel_->stop_reading();
  if (data_) close_data(code == ErrorCode::stalled);
  requests_.clear();
  context_.dispatcher.session_gone(key_);
}

void Session::close_data(bool at_once) {
  if (at_once) {
    // What it did not take in all this time would only stay in the kernel's memory.
    data_->reset();
  } else {
    data_->stop_reading();
  }
}

void Session::server_drains(Duration left) {
  if (closed_ || state_ == proto::SessionState::fresh) return;
  proto::Notice notice;
  notice.kind = proto::NoticeKind::draining;
  notice.seconds = static_cast<std::uint32_t>(std::chrono::ceil<std::chrono::seconds>(left).count());
  notice.text = "the daemon is ending";
  send(proto::encode(notice));
}

void Session::mesh_retired(store::MeshId mesh, Duration grace) {
  if (!closed_) requests_.mesh_retired(mesh, grace);
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
    send_error(proto::peek_id(frame.body), allowed, text);
    co_return true;
  }
  const auto type = static_cast<FrameType>(frame.type);
  if (type == FrameType::goodbye) {
    const auto goodbye = proto::decode<proto::Goodbye>(frame.body);
    close(goodbye ? ErrorCode::none : goodbye.error().code, goodbye ? "goodbye" : goodbye.error().detail);
  } else if (type == FrameType::ping) {
    const auto ping = proto::decode<proto::Ping>(frame.body);
    if (ping) {
      send(proto::encode(proto::Pong{ping.value().id}));
    } else {
      close(ping.error().code, ping.error().detail);
    }
  } else {
    context_.dispatcher.heard(key_);
    if (closed_) co_return false;
    co_await requests_.on_frame(type, frame.body);
  }
  co_return !closed_;
}

}  // namespace pmcd::net
