// SPDX-License-Identifier: MIT
// What each frame from the server means to a session, and the end of a channel.
#include <utility>

#include "client/session_core.h"

namespace pmcd::client {

namespace {

Error refused(const proto::ErrorMessage& message) {
  std::string text = message.text;
  if (text.empty()) {
    const proto::CodeInfo* info = proto::find_code(static_cast<std::uint16_t>(message.code));
    text = info == nullptr ? "it did not say why" : std::string(info->sentence);
  }
  const std::string code =
      std::string(proto::code_name(message.code)) + ", " + std::to_string(static_cast<std::uint16_t>(message.code));
  return {Failure::refused, message.code, "the server refused (" + code + "): " + text};
}

}  // namespace

template <typename M>
std::optional<M> Session::Core::read(const proto::Frame& frame) {
  auto message = proto::decode<M>(frame.body);
  if (message) return std::move(message).value();
  violation(message.error().detail);
  return std::nullopt;
}

void Session::Core::on_request_frame(const proto::Frame& frame) {
  switch (static_cast<proto::FrameType>(frame.type)) {
    case proto::FrameType::hello_ok:
      if (hello_ok_) return violation("a second hello_ok");
      hello_ok_ = read<proto::HelloOk>(frame);
      return;
    case proto::FrameType::error:
      return on_error_frame(frame, false);
    case proto::FrameType::pong:
      if (const auto pong = read<proto::Pong>(frame)) last_pong_ = pong->id;
      return;
    case proto::FrameType::mesh_opened:
      return on_opened(frame);
    case proto::FrameType::notice:
      return on_notice(frame);
    default:
      // A later minor version may send what this one does not know.
      if (const char* name = proto::type_name(frame.type)) violation(std::string(name) + " on the request channel");
  }
}

void Session::Core::on_data_frame(const proto::Frame& frame) {
  switch (static_cast<proto::FrameType>(frame.type)) {
    case proto::FrameType::join_ok:
      if (join_ok_) return violation("a second join_ok");
      join_ok_ = read<proto::JoinOk>(frame).has_value();
      return;
    case proto::FrameType::error:
      return on_error_frame(frame, true);
    case proto::FrameType::chunk: {
      const auto chunk = proto::decode_chunk(frame.body);
      if (!chunk) return violation(chunk.error().detail);
      return on_chunk(*chunk);
    }
    case proto::FrameType::transfer_end:
      return on_transfer_end(frame);
    default:
      if (const char* name = proto::type_name(frame.type)) violation(std::string(name) + " on the data channel");
  }
}

void Session::Core::on_chunk(const proto::ChunkView& chunk) {
  Transfer* transfer = this->transfer(chunk.header.id);
  if (transfer == nullptr) return violation("a chunk of a request that is not open");
  if (auto error = transfer->take(chunk)) fail(std::move(*error));
}

void Session::Core::on_transfer_end(const proto::Frame& frame) {
  const auto end = read<proto::TransferEnd>(frame);
  if (!end) return;
  Transfer* transfer = this->transfer(end->id);
  if (transfer == nullptr) return violation("the end of a request that is not open");
  if (auto error = transfer->finish(*end)) {
    fail(std::move(*error));
  } else if (transfer->discarded()) {
    transfers_.erase(end->id);
  }
}

void Session::Core::on_error_frame(const proto::Frame& frame, bool on_data) {
  const auto message = read<proto::ErrorMessage>(frame);
  if (!message) return;
  if (message->id == 0 || proto::code_ends(message->code) == proto::Ends::session) {
    if (on_data || !data_.socket().is_open()) {
      fail(refused(*message));
      return;
    }
    // It may have overtaken bytes of the data channel, which are worth having: read on there until its end.
    if (!lost_) lost_at_ = Clock::now();
    lost_ = refused(*message);
    request_.close();
    return;
  }
  const Transfer* transfer = this->transfer(message->id);
  if (on_data || transfer == nullptr || transfer->ended()) return violation("an error for a request that is not open");
  if (transfer->started()) return violation("an error on the request channel behind a chunk");
  if (!transfer->discarded()) refusals_.emplace(message->id, refused(*message));
  awaiting_opened_.erase(message->id);
  transfers_.erase(message->id);
}

void Session::Core::on_opened(const proto::Frame& frame) {
  auto message = read<proto::MeshOpened>(frame);
  if (!message) return;
  const auto awaiting = awaiting_opened_.extract(message->id);
  if (awaiting.empty()) return violation("mesh_opened for a request that did not ask for it");
  const std::uint32_t packet = awaiting.mapped();
  auto parsed = codec::parse_directory(message->directory);
  if (!parsed) return violation("the level directory of a mesh is not valid: " + parsed.error().detail);
  if (parsed->size != message->directory.size()) return violation("bytes behind the level directory of a mesh");
  if (parsed->directory.generation != message->generation) return violation("a level directory of another generation");
  if (packet >= parsed->directory.levels.size()) {
    return violation("a level directory without the packet that was asked for");
  }
  const auto known = meshes_.find(message->handle);
  if (known != meshes_.end() && known->second.opened.generation != message->generation) {
    return violation("a handle that was given out for another generation");
  }
  if (Transfer* transfer = this->transfer(message->id)) {
    if (auto error = transfer->expect(message->handle, packet, parsed->directory.levels[packet].bytes)) {
      fail(std::move(*error));
      return;
    }
  }
  opened_.emplace(message->id, OpenedMesh{message->handle, message->generation, std::move(parsed->directory),
                                          std::move(message->directory)});
}

void Session::Core::on_notice(const proto::Frame& frame) {
  const auto notice = read<proto::Notice>(frame);
  if (!notice || !options_.on_notice) return;
  switch (notice->kind) {
    case proto::NoticeKind::draining:
    case proto::NoticeKind::mesh_retired:
      return options_.on_notice(*notice);
  }
  // A kind of a later minor version: skipped.
}

/// A long chunk that the line's end cut through has brought bytes all the same; they are in order and without gaps, and
/// the packet's checksum judges them in the end as it does all others.
void Session::Core::save_unfinished_chunk() {
  proto::ByteReader reader(data_.unfinished());
  reader.u32();
  const std::uint16_t type = reader.u16();
  if (reader.failed() || type != static_cast<std::uint16_t>(proto::FrameType::chunk)) return;
  const auto chunk = proto::decode_chunk(reader.rest());
  if (!chunk) return;  // not even its header is whole
  if (Transfer* transfer = this->transfer(chunk->header.id)) static_cast<void>(transfer->take(*chunk));
}

void Session::Core::on_end(const char* channel, const std::string& why, bool broken_frames) {
  if (broken_frames) {
    return violation("what came on the " + std::string(channel) + " channel is not pmcd's protocol: " + why);
  }
  if (lost_) return;
  lost_ = Error{Failure::lost, proto::ErrorCode::none, "the " + std::string(channel) + " channel was lost: " + why};
  lost_at_ = Clock::now();
  // A channel that was never opened has no last words.
  if (!data_.socket().is_open()) data_.close();
  if (!request_.socket().is_open()) request_.close();
}

}  // namespace pmcd::client
