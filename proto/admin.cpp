// SPDX-License-Identifier: MIT
// Layouts of the admin channel's messages; each pair of functions follows the comment at its struct.
#include "proto/admin.h"

#include <algorithm>

#include "proto/body.h"
#include "proto/text.h"

namespace pmcd::proto {

namespace {

template <typename M>
Bytes encode_admin_hello(const M& message) {
  ByteWriter writer;
  write_version(writer, kAdminMagic, message.version);
  write_agent(writer, message.agent);
  return make_frame(M::kType, writer.take());
}

template <typename M>
Result<M> decode_admin_hello(ByteView body) {
  ByteReader reader(body);
  const auto version = read_version(reader, kAdminMagic);
  if (!version) return version.error();
  M message;
  message.version = *version;
  if (!read_agent(reader, message.agent)) return malformed(8, "the agent's name is too long or cannot be printed");
  return finish_versioned(reader, std::move(message));
}

template <typename M>
Bytes encode_id_and_name(const M& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.str8(message.name);
  return make_frame(M::kType, writer.take());
}

template <typename M>
Result<M> decode_id_and_name(ByteView body) {
  ByteReader reader(body);
  M message;
  message.id = reader.u32();
  message.name = reader.str8();
  if (!reader.failed() && message.id == 0) return malformed(0, "the id of a request is 0");
  return finish(reader, std::move(message));
}

}  // namespace

Bytes encode(const AdminHello& message) {
  return encode_admin_hello(message);
}
Bytes encode(const AdminHelloOk& message) {
  return encode_admin_hello(message);
}
Bytes encode(const AdminList& message) {
  return encode_id_only(message);
}
Bytes encode(const AdminShow& message) {
  return encode_id_and_name(message);
}
Bytes encode(const AdminRemove& message) {
  return encode_id_and_name(message);
}
Bytes encode(const AdminStatus& message) {
  return encode_id_only(message);
}
Bytes encode(const IngestReady& message) {
  return encode_id_only(message);
}
Bytes encode(const IngestCommit& message) {
  return encode_id_only(message);
}

template <>
Result<AdminHello> decode<AdminHello>(ByteView body) {
  return decode_admin_hello<AdminHello>(body);
}

template <>
Result<AdminHelloOk> decode<AdminHelloOk>(ByteView body) {
  return decode_admin_hello<AdminHelloOk>(body);
}

template <>
Result<AdminList> decode<AdminList>(ByteView body) {
  return decode_id_only<AdminList>(body, false);
}

template <>
Result<AdminShow> decode<AdminShow>(ByteView body) {
  return decode_id_and_name<AdminShow>(body);
}

template <>
Result<AdminRemove> decode<AdminRemove>(ByteView body) {
  return decode_id_and_name<AdminRemove>(body);
}

template <>
Result<AdminStatus> decode<AdminStatus>(ByteView body) {
  return decode_id_only<AdminStatus>(body, false);
}

template <>
Result<IngestReady> decode<IngestReady>(ByteView body) {
  return decode_id_only<IngestReady>(body, false);
}

template <>
Result<IngestCommit> decode<IngestCommit>(ByteView body) {
  return decode_id_only<IngestCommit>(body, false);
}

Bytes encode(const AdminAnswer& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u8(message.last ? 1 : 0);
  writer.bytes(as_bytes(message.text));
  return make_frame(AdminAnswer::kType, writer.take());
}

template <>
Result<AdminAnswer> decode<AdminAnswer>(ByteView body) {
  ByteReader reader(body);
  AdminAnswer message;
  message.id = reader.u32();
  const std::uint8_t last = reader.u8();
  if (reader.failed()) return finish(reader, std::move(message));
  if (message.id == 0) return malformed(0, "the id of a request is 0");
  if (last > 1) return malformed(4, "the mark of the last piece is neither 0 nor 1");
  if (reader.left() > kMaxChunkBytes) return malformed(5, "a piece of an answer is too long");
  message.last = last == 1;
  const ByteView text = reader.rest();
  message.text.resize(text.size());
  std::transform(text.begin(), text.end(), message.text.begin(), [](std::byte b) { return static_cast<char>(b); });
  return finish(reader, std::move(message));
}

Bytes encode(const IngestBegin& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u8(message.replace ? 1 : 0);
  writer.str8(message.name);
  writer.bytes(message.directory);
  return make_frame(IngestBegin::kType, writer.take());
}

template <>
Result<IngestBegin> decode<IngestBegin>(ByteView body) {
  ByteReader reader(body);
  IngestBegin message;
  message.id = reader.u32();
  const std::uint8_t flags = reader.u8();
  message.name = reader.str8();
  if (reader.failed()) return finish(reader, std::move(message));
  if (message.id == 0) return malformed(0, "the id of a request is 0");
  if (flags > 1) return malformed(4, "unknown flags of an ingest");
  if (reader.left() == 0 || reader.left() > kMaxDirectoryBytes) {
    return malformed(reader.position(), "the level directory is missing or too long");
  }
  message.replace = flags == 1;
  const ByteView directory = reader.rest();
  message.directory.assign(directory.begin(), directory.end());
  return finish(reader, std::move(message));
}

std::array<std::byte, kIngestDataHeaderBytes> encode_ingest_data_header(const IngestDataHeader& header,
                                                                        std::uint32_t payload_bytes) {
  ByteWriter writer;
  writer.u32(static_cast<std::uint32_t>(kIngestDataHeaderBytes - kLengthBytes) + payload_bytes);
  writer.u16(static_cast<std::uint16_t>(FrameType::ingest_data));
  writer.u32(header.id);
  writer.u32(header.packet);
  writer.u64(header.offset);
  const Bytes bytes = writer.take();
  std::array<std::byte, kIngestDataHeaderBytes> out{};
  std::copy_n(bytes.begin(), out.size(), out.begin());
  return out;
}

Result<IngestDataView> decode_ingest_data(ByteView body) {
  ByteReader reader(body);
  IngestDataView data;
  data.header.id = reader.u32();
  data.header.packet = reader.u32();
  data.header.offset = reader.u64();
  if (reader.failed()) return malformed(reader.position(), "ingest_data is cut short");
  if (data.header.id == 0) return malformed(0, "the id of a request is 0");
  data.bytes = reader.rest();
  if (data.bytes.empty() || data.bytes.size() > kMaxChunkBytes) {
    return malformed(16, "a piece of a packet is empty or too long");
  }
  return data;
}

Bytes encode(const IngestOk& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u64(message.generation);
  writer.u8(message.replaced ? 1 : 0);
  return make_frame(IngestOk::kType, writer.take());
}

template <>
Result<IngestOk> decode<IngestOk>(ByteView body) {
  ByteReader reader(body);
  IngestOk message;
  message.id = reader.u32();
  message.generation = reader.u64();
  const std::uint8_t replaced = reader.u8();
  if (reader.failed()) return finish(reader, message);
  if (message.id == 0) return malformed(0, "the id of a request is 0");
  if (replaced > 1) return malformed(12, "the mark of a replaced mesh is neither 0 nor 1");
  message.replaced = replaced == 1;
  return finish(reader, message);
}

std::vector<Bytes> encode_answer(std::uint32_t id, std::string_view json) {
  std::vector<Bytes> frames;
  do {
    const std::string_view piece = json.substr(0, kMaxChunkBytes);
    json.remove_prefix(piece.size());
    frames.push_back(encode(AdminAnswer{id, json.empty(), std::string(piece)}));
  } while (!json.empty());
  return frames;
}

}  // namespace pmcd::proto
