// SPDX-License-Identifier: MIT
#include "tests/fuzz/client_model.h"

#include <algorithm>
#include <utility>

#include "proto/mesh_list.h"
#include "proto/text.h"
#include "tests/fuzz/check.h"

namespace pmcd::fuzz {

using proto::ErrorCode;
using proto::FrameType;
using proto::SessionState;
using proto::TransferResult;

namespace {

bool is_request(std::uint16_t type) {
  return type >= static_cast<std::uint16_t>(FrameType::get_mesh_list) &&
         type <= static_cast<std::uint16_t>(FrameType::get_packet);
}

template <typename M>
M readable(const proto::Frame& frame) {
  auto message = proto::decode<M>(frame.body);
  if (!message) broken("the server sends a message that cannot be read: " + message.error().detail);
  return std::move(message).value();
}

}  // namespace

bool ClientModel::is_ambiguous(const proto::Frame& frame) const {
  return state_ == SessionState::joined && is_request(frame.type) && open_.contains(proto::peek_id(frame.body));
}

void ClientModel::sent_garbage(proto::Channel channel, ErrorCode code) {
  if (channel == proto::Channel::request) {
    end_codes_.insert(code);
  } else {
    end_codes_.insert(ErrorCode::channel_lost);
    data_codes_.insert(code);
  }
}

void ClientModel::closed(proto::Channel channel) {
  end_codes_.insert(channel == proto::Channel::data ? ErrorCode::channel_lost : ErrorCode::none);
}

void ClientModel::sent_on_request(const proto::Frame& frame) {
  if (must_end()) return;  // it is not read any more
  ++sent_since_settled_;
  const ErrorCode allowed = proto::check_client_frame(proto::Channel::request, state_, frame.type);
  const auto refuse_session = [this](ErrorCode code) { end_codes_.insert(code); };
  if (allowed == ErrorCode::unknown_type) return unknown_types_.push_back(proto::peek_id(frame.body));
  if (allowed == ErrorCode::not_joined) return not_joined_.push_back(proto::peek_id(frame.body));
  if (allowed != ErrorCode::none) return refuse_session(allowed);
  const auto take = [&]<typename M>(const proto::Result<M>& message) {
    if (!message) refuse_session(message.error().code);
    return message.ok();
  };
  switch (static_cast<FrameType>(frame.type)) {
    case FrameType::hello:
      if (take(proto::decode<proto::Hello>(frame.body))) {
        if (draining_) return refuse_session(ErrorCode::shutting_down);
        state_ = SessionState::greeted;
      }
      return;
    case FrameType::goodbye:
      if (take(proto::decode<proto::Goodbye>(frame.body))) refuse_session(ErrorCode::none);
      return;
    case FrameType::ping:
      if (const auto ping = proto::decode<proto::Ping>(frame.body); take(ping)) pongs_.push_back(ping->id);
      return;
    case FrameType::cancel:
      if (const auto cancel = proto::decode<proto::Cancel>(frame.body); take(cancel)) {
        if (const auto it = open_.find(cancel->id); it != open_.end()) it->second.cancel_sent = true;
      }
      return;
    case FrameType::get_mesh_list:
      if (const auto asked = proto::decode<proto::GetMeshList>(frame.body); take(asked)) ask(asked->id, {});
      return;
    case FrameType::get_base_mesh:
      if (const auto asked = proto::decode<proto::GetBaseMesh>(frame.body); take(asked)) {
        Request request;
        request.kind = Kind::base;
        request.name = asked->name;
        ask(asked->id, std::move(request));
      }
      return;
    case FrameType::get_next_packet:
      if (const auto asked = proto::decode<proto::GetNextPacket>(frame.body); take(asked)) {
        Request request;
        request.kind = Kind::next;
        request.handle = asked->handle;
        ask(asked->id, std::move(request));
      }
      return;
    case FrameType::get_packet:
      if (const auto asked = proto::decode<proto::GetPacket>(frame.body); take(asked)) {
        Request request;
        request.kind = Kind::exact;
        request.generation = asked->generation;
        request.packet = asked->packet;
        request.offset = asked->offset;
        ask(asked->id, std::move(request));
      }
      return;
    default:
      return;
  }
}

void ClientModel::ask(std::uint32_t id, Request request) {
  if (open_.contains(id)) {
    end_codes_.insert(ErrorCode::duplicate_id);
    return;
  }
  request.order = order_++;
  request.over_limit = open_.size() >= proto::kMaxOpenRequests;
  request.had_handles = !handles_.empty();
  open_.emplace(id, std::move(request));
}

void ClientModel::sent_on_data(const proto::Frame& frame) {
  ++sent_since_settled_;
  if (state_ != SessionState::joined) {
    // Only the join that fits is sent here, see SessionRig::join.
    state_ = SessionState::joined;
    return;
  }
  const ErrorCode allowed = proto::check_client_frame(proto::Channel::data, SessionState::joined, frame.type);
  if (allowed == ErrorCode::unknown_type) return data_unknown_types_.push_back(proto::peek_id(frame.body));
  end_codes_.insert(ErrorCode::channel_lost);
  data_codes_.insert(allowed);
}

void ClientModel::expect(std::deque<std::uint32_t>& wanted, std::uint32_t id, const char* what) {
  check(!wanted.empty() && wanted.front() == id, what);
  wanted.pop_front();
}

ClientModel::Request& ClientModel::open_request(std::uint32_t id, const char* what) {
  const auto it = open_.find(id);
  if (it == open_.end()) broken(std::string(what) + " " + std::to_string(id) + ", which is not open");
  return it->second;
}

void ClientModel::received_on_request(const proto::Frame& frame) {
  check(!ended_as_, "a frame on the request channel behind the error that ended the session");
  switch (static_cast<FrameType>(frame.type)) {
    case FrameType::hello_ok: {
      const auto message = readable<proto::HelloOk>(frame);
      check(!hello_answered_ && state_ == SessionState::greeted, "hello_ok without a hello");
      check(message.max_open_requests == proto::kMaxOpenRequests, "another number of open requests");
      hello_answered_ = true;
      token_ = message.token;
      return;
    }
    case FrameType::pong:
      return expect(pongs_, readable<proto::Pong>(frame).id, "a pong without its ping");
    case FrameType::error:
      return refused(readable<proto::ErrorMessage>(frame));
    case FrameType::mesh_opened:
      return opened(readable<proto::MeshOpened>(frame));
    case FrameType::notice:
      return notice(readable<proto::Notice>(frame));
    default:
      broken("a frame on the request channel that does not belong there");
  }
}

void ClientModel::refused(const proto::ErrorMessage& error) {
  if (proto::code_ends(error.code) == proto::Ends::session) {
    check(error.id == 0, "an error that ends the session has the id of a request");
    return ended_by(error.code);
  }
  if (error.code == ErrorCode::unknown_type) {
    return expect(unknown_types_, error.id, "unknown_type for a frame that was not sent, or out of order");
  }
  if (error.code == ErrorCode::not_joined) {
    return expect(not_joined_, error.id, "not_joined for a request that was not sent, or out of order");
  }
  const Request request = open_request(error.id, "an error for the request");
  check(!request.begun, "an error ends a request that has chunks");
  check_reason(request, error.code);
  if (const auto it = handles_.find(request.handle); proto::code_ends(error.code) == proto::Ends::mesh) {
    if (it != handles_.end()) it->second.dead = true;
  }
  open_.erase(error.id);
}

void ClientModel::check_reason(const Request& request, ErrorCode code) const {
  const bool is_full = handles_.size() + 1 >= limits_.meshes_per_session;
  switch (code) {
    case ErrorCode::too_many_requests:
      check(request.over_limit || ((request.kind == Kind::base || request.kind == Kind::exact) && is_full),
            "too_many_requests for a request that was allowed");
      return;
    case ErrorCode::unknown_mesh:
      check(request.kind == Kind::base && !source_.always_there(request.name), "unknown_mesh for a mesh that is there");
      return;
    case ErrorCode::bad_name:
      check(request.kind == Kind::base && !proto::is_mesh_name(request.name), "bad_name for a good name");
      return;
    case ErrorCode::unknown_handle: {
      const auto it = handles_.find(request.handle);
      check(request.kind == Kind::next, "unknown_handle for a request that names none");
      check(is_full || it == handles_.end() || it->second.dead, "unknown_handle for a handle that was given out");
      check(request.handle != 0 || !request.had_handles || is_full, "no last mesh although one was opened");
      return;
    }
    case ErrorCode::internal_error:
      check(request.kind == Kind::list && source_.has_failed(), "internal_error, but nothing failed");
      return;
    case ErrorCode::bad_range: {
      check(request.kind == Kind::exact, "bad_range for a request without a range");
      const Content* content = content_of(request.generation);
      check(content != nullptr, "bad_range of a mesh that never was");
      check(request.packet >= content->packets.size() || request.offset >= content->packets[request.packet]->size(),
            "bad_range for a good range");
      return;
    }
    case ErrorCode::unavailable:
      check(request.kind != Kind::list && source_.has_failed(), "unavailable, but nothing failed");
      return;
    case ErrorCode::mesh_changed:
      check(request.kind != Kind::list, "mesh_changed for a list");
      check(source_.has_lost() || (request.kind == Kind::exact && !request.opened),
            "mesh_changed, but nothing was lost");
      return;
    default:
      broken("an error that no request of a session can end by");
  }
}

void ClientModel::opened(const proto::MeshOpened& message) {
  Request& request = open_request(message.id, "mesh_opened for the request");
  check(request.kind == Kind::base || request.kind == Kind::exact, "mesh_opened for a request that opens none");
  check(!request.opened, "mesh_opened twice for one request");
  request.opened = true;
  request.handle = message.handle;
  const Content* content = content_of(message.generation);
  check(content != nullptr && content->directory == message.directory, "mesh_opened with a directory of another mesh");
  if (request.kind == Kind::base) {
    check(source_.ever_had(request.name, message.generation), "a mesh of that name never had this generation");
  } else {
    check(message.generation == request.generation, "get_packet opens another generation");
  }
  const auto [it, is_new] = handles_.try_emplace(message.handle);
  handles_given_.insert(message.handle);
  if (is_new) {
    it->second.generation = message.generation;
    it->second.places = {request.kind == Kind::exact ? request.packet : 0};
    return;
  }
  check(request.kind == Kind::base, "get_packet opens a handle that is in use");
  check(it->second.generation == message.generation, "a handle changes its generation");
  check(!it->second.dead, "a handle that is of no use any more is given out again");
}

void ClientModel::notice(const proto::Notice& notice) {
  if (notice.kind == proto::NoticeKind::draining) {
    check(draining_ && notice.handle == 0, "the server drains, but nobody told it to");
    return;
  }
  check(notice.kind == proto::NoticeKind::mesh_retired, "a notice of an unknown kind");
  check(handles_.contains(notice.handle), "a notice about a handle that was not given out");
}

void ClientModel::ended_by(ErrorCode code) {
  check(end_codes_.contains(code) || (code == ErrorCode::stalled && may_stall()),
        "the server ends the session for no reason");
  end_codes_.insert(code);
  ended_as_ = code;
}

bool ClientModel::may_stall() const {
  // Frames that may wait at once: what the client asked for and has not read, and chunks, which are at least one byte.
  const std::size_t chunks = limits_.queued_bytes / (proto::kChunkHeaderBytes + 1) + 2;
  return sent_since_settled_ + 2 * proto::kMaxOpenRequests + chunks > limits_.queued_frames;
}

void ClientModel::received_on_data(const proto::Frame& frame) {
  const auto type = static_cast<FrameType>(frame.type);
  if (!join_answered_) {
    check(type == FrameType::join_ok && state_ == SessionState::joined, "the data channel does not begin with join_ok");
    readable<proto::JoinOk>(frame);
    join_answered_ = true;
  } else if (type == FrameType::error) {
    const auto error = readable<proto::ErrorMessage>(frame);
    if (error.code == ErrorCode::unknown_type) {
      return expect(data_unknown_types_, error.id, "unknown_type on the data channel for nothing");
    }
    check(error.id == 0 && data_codes_.contains(error.code), "an error on the data channel for nothing");
  } else if (type == FrameType::chunk) {
    const auto decoded = proto::decode_chunk(frame.body);
    check(decoded.ok(), "the server sends a chunk that cannot be read");
    chunk(*decoded);
  } else if (type == FrameType::transfer_end) {
    transfer_end(readable<proto::TransferEnd>(frame));
  } else {
    broken("a frame on the data channel that does not belong there");
  }
}

ClientModel::Place ClientModel::place_in_line(const Request& request) const {
  Place place = Place::front;
  for (const auto& [id, other] : open_) {
    if (other.order >= request.order || other.kind == Kind::list) continue;
    if (other.handle == request.handle) return Place::behind;
    if (other.handle == 0) place = Place::unknown;
  }
  return place;
}

void ClientModel::begin(Request& request, const proto::ChunkHeader& header) {
  request.begun = true;
  request.brings = header.packet;
  request.total = header.total;
  request.next = request.kind == Kind::exact ? request.offset : 0;
  if (request.kind == Kind::list) {
    check(header.handle == 0 && header.packet == 0, "a mesh list with a handle or a packet");
    check(header.total <= proto::kMaxMeshPageBytes, "a mesh list that is too long");
    return;
  }
  const auto it = handles_.find(header.handle);
  check(it != handles_.end(), "a chunk of a handle that was not given out");
  check(request.handle == 0 || request.handle == header.handle, "a chunk of another handle than was asked for");
  check(request.kind != Kind::base || request.opened, "a chunk before mesh_opened");
  request.handle = header.handle;
  Handle& handle = it->second;
  check(place_in_line(request) != Place::behind, "a request overtakes another of its mesh");
  if (request.kind == Kind::base) {
    check(header.packet == 0, "get_base_mesh brings another packet than 0");
  } else if (request.kind == Kind::exact) {
    check(header.packet == request.packet, "get_packet brings another packet");
    check(handle.generation == request.generation, "get_packet brings another generation");
  } else {
    check(handle.places.contains(header.packet), "get_next_packet brings a packet that does not stand at the place");
    handle.places = {header.packet};
  }
  const Content* content = content_of(handle.generation);
  check(content != nullptr && header.packet < content->packets.size() &&
            header.total == content->packets[header.packet]->size(),
        "a transfer of another length than its packet");
}

void ClientModel::chunk(const proto::ChunkView& chunk) {
  Request& request = open_request(chunk.header.id, "a chunk of the request");
  if (!request.begun) begin(request, chunk.header);
  check(chunk.header.packet == request.brings && (request.kind == Kind::list || chunk.header.handle == request.handle),
        "chunks of two packets in one transfer");
  check(chunk.header.total == request.total, "chunks of one transfer disagree on its length");
  check(chunk.header.offset == request.next, "a gap between two chunks, or a wrong beginning");
  request.next += chunk.bytes.size();
  if (request.kind == Kind::list) {
    request.page.insert(request.page.end(), chunk.bytes.begin(), chunk.bytes.end());
    return;
  }
  const auto& packet = *content_of(handles_.at(request.handle).generation)->packets[request.brings];
  check(std::equal(chunk.bytes.begin(), chunk.bytes.end(),
                   packet.begin() + static_cast<std::ptrdiff_t>(chunk.header.offset)),
        "a chunk with bytes that are not the packet's");
}

void ClientModel::transfer_end(const proto::TransferEnd& end) {
  const Request request = open_request(end.id, "transfer_end of the request");
  Handle* handle = handles_.contains(request.handle) ? &handles_.at(request.handle) : nullptr;
  switch (end.result) {
    case TransferResult::complete:
      check(request.begun && request.next == request.total, "a transfer is complete before its last byte");
      if (request.kind == Kind::list) {
        check(source_.gave_page(request.page) && proto::decode_mesh_page(request.page).ok(), "not the list's bytes");
      } else {
        handle->places = {request.brings + 1};
      }
      break;
    case TransferResult::cancelled:
      check(request.cancel_sent, "a request is cancelled that nobody cancelled");
      break;
    case TransferResult::end_of_mesh:
      check(request.kind == Kind::next && !request.begun, "the end of the mesh after a chunk, or for no next packet");
      if (handle != nullptr) {
        const auto count = static_cast<std::uint32_t>(content_of(handle->generation)->packets.size());
        check(place_in_line(request) != Place::behind, "a request overtakes another of its mesh");
        check(handle->places.contains(count), "the end of the mesh is told before its end");
        handle->places = {count};
      }
      break;
    case TransferResult::failed:
      // Only what was interrupted can fail behind its beginning: its packet is read anew for each turn.
      check(request.begun && request.kind != Kind::list, "a transfer fails before its beginning");
      check_reason(request, end.code);
      if (handle != nullptr) handle->dead = true;
      break;
  }
  open_.erase(end.id);
}

void ClientModel::settled(bool session_closed, bool heard, bool idle) {
  check(!session_closed || must_end(), "the server ended the session without a word and for no reason");
  if (session_closed || !heard) return;
  check(!must_end(), "the server goes on with a session that has to end");
  sent_since_settled_ = 0;
  check(hello_answered_ == (state_ != SessionState::fresh), "a hello is not answered");
  check(join_answered_ == (state_ == SessionState::joined), "a join is not answered");
  check(pongs_.empty(), "a ping is not answered");
  check(unknown_types_.empty() && data_unknown_types_.empty(), "a frame of unknown type is not answered");
  check(not_joined_.empty(), "a request before the join is not answered");
  check(open_.size() <= proto::kMaxOpenRequests, "more requests are open than may be");
  check(!idle || open_.empty(), "a request has no end");
}

}  // namespace pmcd::fuzz
