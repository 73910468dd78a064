// SPDX-License-Identifier: MIT
// Layouts of what a client asks for, and of cancel; the other messages of these channels are in messages.cpp.
#include <utility>

#include "proto/body.h"
#include "proto/messages.h"

namespace pmcd::proto {

Bytes encode(const GetMeshList& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.str8(message.filter);
  writer.str8(message.after);
  writer.u16(message.most);
  return make_frame(GetMeshList::kType, writer.take());
}

template <>
Result<GetMeshList> decode<GetMeshList>(ByteView body) {
  ByteReader reader(body);
  GetMeshList message;
  message.id = reader.u32();
  message.filter = reader.str8();
  message.after = reader.str8();
  message.most = reader.u16();
  if (!reader.failed() && message.id == 0) return malformed(0, "the id of a request is 0");
  if (message.filter.size() > kMaxNameBytes || message.after.size() > kMaxNameBytes) {
    return malformed(4, "a filter or a name to go on after is longer than any name");
  }
  return finish(reader, std::move(message));
}

Bytes encode(const GetBaseMesh& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.str8(message.name);
  return make_frame(GetBaseMesh::kType, writer.take());
}

template <>
Result<GetBaseMesh> decode<GetBaseMesh>(ByteView body) {
  ByteReader reader(body);
  GetBaseMesh message;
  message.id = reader.u32();
  message.name = reader.str8();
  return finish_request(reader, std::move(message));
}

Bytes encode(const GetNextPacket& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u32(message.handle);
  return make_frame(GetNextPacket::kType, writer.take());
}

template <>
Result<GetNextPacket> decode<GetNextPacket>(ByteView body) {
  ByteReader reader(body);
  GetNextPacket message;
  message.id = reader.u32();
  message.handle = reader.u32();
  return finish_request(reader, message);
}

Bytes encode(const GetPacket& message) {
  ByteWriter writer;
  writer.u32(message.id);
  writer.u64(message.generation);
  writer.u32(message.packet);
  writer.u64(message.offset);
  return make_frame(GetPacket::kType, writer.take());
}

template <>
Result<GetPacket> decode<GetPacket>(ByteView body) {
  ByteReader reader(body);
  GetPacket message;
  message.id = reader.u32();
  message.generation = reader.u64();
  message.packet = reader.u32();
  message.offset = reader.u64();
  return finish_request(reader, message);
}

Bytes encode(const Cancel& message) {
  return encode_id_only(message);
}

template <>
Result<Cancel> decode<Cancel>(ByteView body) {
  return decode_id_only<Cancel>(body, false);
}

}  // namespace pmcd::proto
