// SPDX-License-Identifier: MIT
// Taking a stream apart into frames, and making one. The reader never trusts the length beyond comparing it.
#include "proto/frame.h"

#include <algorithm>
#include <string>

namespace pmcd::proto {

namespace {

constexpr std::size_t kKeptCapacity = 4096;

std::uint32_t read_length(ByteView buffer) {
  ByteReader reader(buffer);
  return reader.u32();
}

}  // namespace

const char* type_name(std::uint16_t type) {
  switch (static_cast<FrameType>(type)) {
    case FrameType::hello:
      return "hello";
    case FrameType::hello_ok:
      return "hello_ok";
    case FrameType::error:
      return "error";
    case FrameType::ping:
      return "ping";
    case FrameType::pong:
      return "pong";
    case FrameType::goodbye:
      return "goodbye";
    case FrameType::join:
      return "join";
    case FrameType::join_ok:
      return "join_ok";
    case FrameType::notice:
      return "notice";
    case FrameType::get_mesh_list:
      return "get_mesh_list";
    case FrameType::get_base_mesh:
      return "get_base_mesh";
    case FrameType::get_next_packet:
      return "get_next_packet";
    case FrameType::get_packet:
      return "get_packet";
    case FrameType::cancel:
      return "cancel";
    case FrameType::mesh_opened:
      return "mesh_opened";
    case FrameType::chunk:
      return "chunk";
    case FrameType::transfer_end:
      return "transfer_end";
    case FrameType::admin_hello:
      return "admin_hello";
    case FrameType::admin_hello_ok:
      return "admin_hello_ok";
    case FrameType::admin_list:
      return "admin_list";
    case FrameType::admin_show:
      return "admin_show";
    case FrameType::admin_remove:
      return "admin_remove";
    case FrameType::admin_status:
      return "admin_status";
    case FrameType::ingest_begin:
      return "ingest_begin";
    case FrameType::ingest_ready:
      return "ingest_ready";
    case FrameType::ingest_data:
      return "ingest_data";
    case FrameType::ingest_commit:
      return "ingest_commit";
    case FrameType::ingest_ok:
      return "ingest_ok";
    case FrameType::admin_answer:
      return "admin_answer";
    case FrameType::admin_rules:
      return "admin_rules";
    case FrameType::admin_rule:
      return "admin_rule";
    case FrameType::admin_set_rule:
      return "admin_set_rule";
    case FrameType::admin_history:
      return "admin_history";
    case FrameType::admin_revert:
      return "admin_revert";
    case FrameType::admin_queue:
      return "admin_queue";
    case FrameType::admin_clients:
      return "admin_clients";
    case FrameType::admin_explain:
      return "admin_explain";
    case FrameType::admin_weight:
      return "admin_weight";
  }
  return nullptr;
}

Result<std::optional<Frame>> FrameReader::next(ByteView& input) {
  if (failed_) return *failed_;
  if (taken_) {
    taken_ = false;
    buffer_.clear();
    if (buffer_.capacity() > kKeptCapacity) buffer_.shrink_to_fit();
  }

  const auto take = [&](std::size_t wanted) {
    const std::size_t count = std::min(wanted - std::min(wanted, buffer_.size()), input.size());
    buffer_.insert(buffer_.end(), input.begin(), input.begin() + static_cast<std::ptrdiff_t>(count));
    input = input.subspan(count);
    return buffer_.size() >= wanted;
  };

  if (!take(kLengthBytes)) return std::optional<Frame>{};
  const std::uint32_t length = read_length(buffer_);
  if (length > max_length_) {
    failed_ = Error{ErrorCode::frame_too_long, 0,
                    "a frame of " + std::to_string(length) + " bytes, " + std::to_string(max_length_) + " are allowed"};
    return *failed_;
  }
  if (length < kTypeBytes) {
    failed_ = Error{ErrorCode::malformed, 0, "a frame of " + std::to_string(length) + " bytes cannot hold its type"};
    return *failed_;
  }
  if (!take(kLengthBytes + length)) return std::optional<Frame>{};

  taken_ = true;
  const ByteView content = ByteView(buffer_).subspan(kLengthBytes);
  ByteReader reader(content);
  Frame frame;
  frame.type = reader.u16();
  frame.body = reader.rest();
  return std::optional<Frame>{frame};
}

bool FrameReader::mid_frame() const {
  return !taken_ && !buffer_.empty();
}

ByteView FrameReader::unfinished() const {
  return taken_ ? ByteView{} : ByteView(buffer_);
}

Bytes make_frame(FrameType type, ByteView body) {
  ByteWriter writer;
  writer.reserve(kFrameHeaderBytes + body.size());
  writer.u32(static_cast<std::uint32_t>(kTypeBytes + body.size()));
  writer.u16(static_cast<std::uint16_t>(type));
  writer.bytes(body);
  return writer.take();
}

}  // namespace pmcd::proto
