// SPDX-License-Identifier: MIT
// Layouts of the request and data channels' messages but the requests; each pair of functions follows the comment at
// its struct.
#include "proto/messages.h"

#include <algorithm>

#include "proto/body.h"
#include "proto/text.h"

namespace pmcd::proto {

const char* result_name(TransferResult result) {
  switch (result) {
    case TransferResult::complete:
      return "complete";
    case TransferResult::cancelled:
      return "cancelled";
    case TransferResult::failed:
      return "failed";
    case TransferResult::end_of_mesh:
      return "end_of_mesh";
  }
  return "failed";
}

Bytes encode(const Hello& message) {
  ByteWriter writer;
  write_version(writer, kMagic, message.version);
  write_agent(writer, message.agent);
  return make_frame(Hello::kType, writer.take());
}

template <>
Result<Hello> decode<Hello>(ByteView body) {
  ByteReader reader(body);
  const auto version = read_version(reader, kMagic);
  if (!version) return version.error();
  Hello message;
  message.version = *version;
  if (!read_agent(reader, message.agent)) return malformed(8, "the agent's name is too long or cannot be printed");
  return finish_versioned(reader, std::move(message));
}

Bytes encode(const HelloOk& message) {
  ByteWriter writer;
  write_version(writer, kMagic, message.version);
  writer.bytes(message.token);
  writer.u16(message.data_port);
  writer.u16(message.join_seconds);
  writer.u8(message.max_open_requests);
  write_agent(writer, message.agent);
  return make_frame(HelloOk::kType, writer.take());
}

template <>
Result<HelloOk> decode<HelloOk>(ByteView body) {
  ByteReader reader(body);
  const auto version = read_version(reader, kMagic);
  if (!version) return version.error();
  HelloOk message;
  message.version = *version;
  message.token = reader.array<16>();
  message.data_port = reader.u16();
  message.join_seconds = reader.u16();
  message.max_open_requests = reader.u8();
  if (!read_agent(reader, message.agent)) return malformed(29, "the agent's name is too long or cannot be printed");
  if (!reader.failed() && message.data_port == 0) return malformed(24, "the data port is 0");
  if (!reader.failed() && message.max_open_requests == 0) return malformed(28, "no open request is allowed");
  return finish_versioned(reader, std::move(message));
}

Bytes encode(const Join& message) {
  ByteWriter writer;
  write_version(writer, kMagic, message.version);
  writer.bytes(message.token);
  return make_frame(Join::kType, writer.take());
}

template <>
Result<Join> decode<Join>(ByteView body) {
  ByteReader reader(body);
  const auto version = read_version(reader, kMagic);
  if (!version) return version.error();
  Join message;
  message.version = *version;
  message.token = reader.array<16>();
  return finish_versioned(reader, message);
}

Bytes encode(const JoinOk& message) {
  ByteWriter writer;
  write_version(writer, kMagic, message.version);
  return make_frame(JoinOk::kType, writer.take());
}

template <>
Result<JoinOk> decode<JoinOk>(ByteView body) {
  ByteReader reader(body);
  const auto version = read_version(reader, kMagic);
  if (!version) return version.error();
  JoinOk message;
  message.version = *version;
  return finish_versioned(reader, message);
}

Bytes encode(const ErrorMessage& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u16(static_cast<std::uint16_t>(message.code));
  writer.str16(printable(message.text, kMaxErrorTextBytes));
  return make_frame(ErrorMessage::kType, writer.take());
}

template <>
Result<ErrorMessage> decode<ErrorMessage>(ByteView body) {
  ByteReader reader(body);
  ErrorMessage message;
  message.id = reader.u32();
  message.code = static_cast<ErrorCode>(reader.u16());
  message.text = reader.str16();
  if (!reader.failed() && message.code == ErrorCode::none) return malformed(4, "an error with code 0");
  if (message.text.size() > kMaxErrorTextBytes || !is_printable_utf8(message.text)) {
    return malformed(6, "the error's text is too long or cannot be printed");
  }
  return finish(reader, std::move(message));
}

Bytes encode(const Ping& message) {
  return encode_id_only(message);
}
Bytes encode(const Pong& message) {
  return encode_id_only(message);
}
Bytes encode(const Goodbye&) {
  return make_frame(Goodbye::kType, {});
}

template <>
Result<Ping> decode<Ping>(ByteView body) {
  return decode_id_only<Ping>(body, true);
}

template <>
Result<Pong> decode<Pong>(ByteView body) {
  return decode_id_only<Pong>(body, true);
}

template <>
Result<Goodbye> decode<Goodbye>(ByteView body) {
  return finish(ByteReader(body), Goodbye{});
}

Bytes encode(const Notice& message) {
  ByteWriter writer;
  writer.u16(static_cast<std::uint16_t>(message.kind));
  writer.u32(message.handle);
  writer.u32(message.seconds);
  writer.str16(printable(message.text, kMaxErrorTextBytes));
  return make_frame(Notice::kType, writer.take());
}

template <>
Result<Notice> decode<Notice>(ByteView body) {
  ByteReader reader(body);
  Notice message;
  message.kind = static_cast<NoticeKind>(reader.u16());
  message.handle = reader.u32();
  message.seconds = reader.u32();
  message.text = reader.str16();
  if (message.text.size() > kMaxErrorTextBytes || !is_printable_utf8(message.text)) {
    return malformed(10, "the notice's text is too long or cannot be printed");
  }
  return finish(reader, std::move(message));
}

Bytes encode(const MeshOpened& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u32(message.handle);
  writer.u64(message.generation);
  writer.bytes(message.directory);
  return make_frame(MeshOpened::kType, writer.take());
}

template <>
Result<MeshOpened> decode<MeshOpened>(ByteView body) {
  ByteReader reader(body);
  MeshOpened message;
  message.id = reader.u32();
  message.handle = reader.u32();
  message.generation = reader.u64();
  if (reader.failed()) return finish(reader, std::move(message));
  if (message.id == 0) return malformed(0, "the id of a request is 0");
  if (message.handle == 0) return malformed(4, "the handle of an opened mesh is 0");
  if (reader.left() == 0 || reader.left() > kMaxDirectoryBytes) {
    return malformed(16, "the level directory is missing or too long");
  }
  const ByteView directory = reader.rest();
  message.directory.assign(directory.begin(), directory.end());
  return finish(reader, std::move(message));
}

std::array<std::byte, kChunkHeaderBytes> encode_chunk_header(const ChunkHeader& header, std::uint32_t payload_bytes) {
  ByteWriter writer;
  writer.u32(static_cast<std::uint32_t>(kChunkHeaderBytes - kLengthBytes) + payload_bytes);
  writer.u16(static_cast<std::uint16_t>(FrameType::chunk));
  writer.u32(header.id);
  writer.u32(header.handle);
  writer.u32(header.packet);
  writer.u64(header.offset);
  writer.u64(header.total);
  const Bytes bytes = writer.take();
  std::array<std::byte, kChunkHeaderBytes> out{};
  std::copy_n(bytes.begin(), out.size(), out.begin());
  return out;
}

Result<ChunkView> decode_chunk(ByteView body) {
  ByteReader reader(body);
  ChunkView chunk;
  chunk.header.id = reader.u32();
  chunk.header.handle = reader.u32();
  chunk.header.packet = reader.u32();
  chunk.header.offset = reader.u64();
  chunk.header.total = reader.u64();
  if (reader.failed()) return malformed(reader.position(), "chunk is cut short");
  if (chunk.header.id == 0) return malformed(0, "the id of a chunk is 0");
  chunk.bytes = reader.rest();
  const std::uint64_t size = chunk.bytes.size();
  if (size == 0 || size > kMaxChunkBytes) return malformed(28, "a chunk is empty or too long");
  if (chunk.header.offset > chunk.header.total || size > chunk.header.total - chunk.header.offset) {
    return malformed(12, "a chunk reaches beyond the total that it names");
  }
  return chunk;
}

Bytes encode(const TransferEnd& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u8(static_cast<std::uint8_t>(message.result));
  writer.u16(static_cast<std::uint16_t>(message.code));
  return make_frame(TransferEnd::kType, writer.take());
}

template <>
Result<TransferEnd> decode<TransferEnd>(ByteView body) {
  ByteReader reader(body);
  TransferEnd message;
  message.id = reader.u32();
  const std::uint8_t result = reader.u8();
  message.code = static_cast<ErrorCode>(reader.u16());
  if (reader.failed()) return finish(reader, message);
  if (message.id == 0) return malformed(0, "the id of a transfer is 0");
  if (result > static_cast<std::uint8_t>(TransferResult::end_of_mesh)) {
    return malformed(4, "a transfer ended in a way that is not known");
  }
  message.result = static_cast<TransferResult>(result);
  if ((message.result == TransferResult::failed) != (message.code != ErrorCode::none)) {
    return malformed(5, "the end of a transfer has a code although it did not fail, or none although it did");
  }
  return finish(reader, message);
}

std::uint32_t peek_id(ByteView body) {
  ByteReader reader(body);
  return reader.u32();
}

}  // namespace pmcd::proto
