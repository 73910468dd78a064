// SPDX-License-Identifier: MIT
// Heads of frames; the payloads are the header's template.
#include "bench/serve/data_stream.h"

#include <cstring>
#include <string>

#include "bench/serve/link.h"
#include "proto/bytes.h"

namespace pmcd::bench {

bool DataStream::hold(proto::ByteView& input, std::size_t wanted) {
  const std::size_t count = std::min(wanted - std::min(wanted, held_bytes_), input.size());
  std::memcpy(held_.data() + held_bytes_, input.data(), count);
  held_bytes_ += count;
  input = input.subspan(count);
  return held_bytes_ >= wanted;
}

std::optional<proto::Frame> DataStream::gather(proto::ByteView& input) {
  if (!hold(input, proto::kFrameHeaderBytes)) return std::nullopt;
  proto::ByteReader reader(held_);
  const std::uint32_t length = reader.u32();
  const std::uint16_t type = reader.u16();
  const bool is_chunk = type == static_cast<std::uint16_t>(proto::FrameType::chunk);
  if (length < proto::kTypeBytes || length > proto::kMaxDataFrame ||
      (!is_chunk && length + proto::kLengthBytes > held_.size())) {
    fail("the data channel brings a frame of " + std::to_string(length) + " bytes");
  }
  const std::size_t frame_bytes = proto::kLengthBytes + length;
  if (!is_chunk) {
    if (!hold(input, frame_bytes)) return std::nullopt;
    held_bytes_ = 0;
    const proto::ByteView whole = proto::ByteView(held_).first(frame_bytes);
    return proto::Frame{type, whole.subspan(proto::kFrameHeaderBytes)};
  }
  if (frame_bytes <= proto::kChunkHeaderBytes) fail("a chunk without a payload");
  if (!hold(input, proto::kChunkHeaderBytes)) return std::nullopt;
  held_bytes_ = 0;
  chunk_.id = reader.u32();
  chunk_.handle = reader.u32();
  chunk_.packet = reader.u32();
  chunk_.offset = reader.u64();
  chunk_.total = reader.u64();
  payload_left_ = frame_bytes - proto::kChunkHeaderBytes;
  return std::nullopt;
}

}  // namespace pmcd::bench
