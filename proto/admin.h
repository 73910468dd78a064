// SPDX-License-Identifier: MIT
// The messages of the admin channel (a Unix stream socket), same frames as the other channels, own hello and magic.
// Requests carry an id that the operator's tool chose (not 0) and end by exactly one of admin_answer with last = 1,
// ingest_ok, or error(id). They are answered in the order in which they came.
//
// Ingest: ingest_begin -> ingest_ready | error; then ingest_data in order (packet 0 from offset 0, without gaps);
// then ingest_commit -> ingest_ok | error. Nothing is visible before ingest_ok; a connection that ends before leaves
// nothing. After error(id) the daemon silently drops ingest_data and ingest_commit of that id which were on their way.
//
// JSON of the answers (fields may be added, readers ignore what they do not know). A mesh object:
//   {"name","generation" (16 hex digits),"vertices","faces","packets","bytes","lossless","bits",
//    "scalar":"float32"|"float64","format_version","box_min":[x,y,z],"box_max":[x,y,z],"ingested_at" (RFC 3339, UTC)}
// list:   {"meshes":[mesh...],"damaged":[{"name","error"}...]} ascending by name.
// show:   mesh and "levels":[{"level","bytes","vertices","faces","error_rms"|null,"error_max"|null,"crc32c" (8 hex)}]
// remove: {"removed":name,"generation"}
// status:
// {"version","protocol":"1.0","rule","slots","sessions","waiting","running","meshes","damaged_meshes","listen","request_port",
//          "data_port","started_at","uptime_seconds"}
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "proto/messages.h"

namespace pmcd::proto {

/// magic "PMCA", Version, str8 agent.
struct AdminHello {
  static constexpr FrameType kType = FrameType::admin_hello;
  Version version;
  std::string agent;
  bool operator==(const AdminHello&) const = default;
};

/// magic "PMCA", Version, str8 agent (name and version of the daemon).
struct AdminHelloOk {
  static constexpr FrameType kType = FrameType::admin_hello_ok;
  Version version;
  std::string agent;
  bool operator==(const AdminHelloOk&) const = default;
};

/// u32 id.
struct AdminList {
  static constexpr FrameType kType = FrameType::admin_list;
  std::uint32_t id = 0;
  bool operator==(const AdminList&) const = default;
};

/// u32 id, str8 name (as in GetBaseMesh: is_mesh_name is for the daemon to judge).
struct AdminShow {
  static constexpr FrameType kType = FrameType::admin_show;
  std::uint32_t id = 0;
  std::string name;
  bool operator==(const AdminShow&) const = default;
};

/// u32 id, str8 name.
struct AdminRemove {
  static constexpr FrameType kType = FrameType::admin_remove;
  std::uint32_t id = 0;
  std::string name;
  bool operator==(const AdminRemove&) const = default;
};

/// u32 id.
struct AdminStatus {
  static constexpr FrameType kType = FrameType::admin_status;
  std::uint32_t id = 0;
  bool operator==(const AdminStatus&) const = default;
};

/// u32 id, u8 last (0 or 1), rest: up to kMaxChunkBytes bytes of JSON text; the pieces in order make the document.
struct AdminAnswer {
  static constexpr FrameType kType = FrameType::admin_answer;
  std::uint32_t id = 0;
  bool last = true;
  std::string text;
  bool operator==(const AdminAnswer&) const = default;
};

/// u32 id, u8 flags (bit 0: replace a mesh of that name), str8 name, rest: level directory, 1 to kMaxDirectoryBytes
/// bytes (codec::serialize(Directory)); it says how many packets follow and how long each is.
struct IngestBegin {
  static constexpr FrameType kType = FrameType::ingest_begin;
  std::uint32_t id = 0;
  bool replace = false;
  std::string name;
  Bytes directory;
  bool operator==(const IngestBegin&) const = default;
};

/// u32 id.
struct IngestReady {
  static constexpr FrameType kType = FrameType::ingest_ready;
  std::uint32_t id = 0;
  bool operator==(const IngestReady&) const = default;
};

/// u32 id, u32 packet, u64 offset; rest: 1 to kMaxChunkBytes bytes.
struct IngestDataHeader {
  std::uint32_t id = 0;
  std::uint32_t packet = 0;
  std::uint64_t offset = 0;
  bool operator==(const IngestDataHeader&) const = default;
};
inline constexpr std::size_t kIngestDataHeaderBytes = kFrameHeaderBytes + 16;  ///< frame header included

struct IngestDataView {
  IngestDataHeader header;
  ByteView bytes;  ///< points into the body that was decoded
};

/// u32 id.
struct IngestCommit {
  static constexpr FrameType kType = FrameType::ingest_commit;
  std::uint32_t id = 0;
  bool operator==(const IngestCommit&) const = default;
};

/// u32 id, u64 generation, u8 replaced (0 or 1: there was a mesh of that name).
struct IngestOk {
  static constexpr FrameType kType = FrameType::ingest_ok;
  std::uint32_t id = 0;
  std::uint64_t generation = 0;
  bool replaced = false;
  bool operator==(const IngestOk&) const = default;
};

Bytes encode(const AdminHello& message);
Bytes encode(const AdminHelloOk& message);
Bytes encode(const AdminList& message);
Bytes encode(const AdminShow& message);
Bytes encode(const AdminRemove& message);
Bytes encode(const AdminStatus& message);
Bytes encode(const AdminAnswer& message);
Bytes encode(const IngestBegin& message);
Bytes encode(const IngestReady& message);
Bytes encode(const IngestCommit& message);
Bytes encode(const IngestOk& message);

/// REQUIRES: 1 <= payload_bytes <= kMaxChunkBytes.
std::array<std::byte, kIngestDataHeaderBytes> encode_ingest_data_header(const IngestDataHeader& header,
                                                                        std::uint32_t payload_bytes);

template <>
Result<AdminHello> decode<AdminHello>(ByteView body);
template <>
Result<AdminHelloOk> decode<AdminHelloOk>(ByteView body);
template <>
Result<AdminList> decode<AdminList>(ByteView body);
template <>
Result<AdminShow> decode<AdminShow>(ByteView body);
template <>
Result<AdminRemove> decode<AdminRemove>(ByteView body);
template <>
Result<AdminStatus> decode<AdminStatus>(ByteView body);
template <>
Result<AdminAnswer> decode<AdminAnswer>(ByteView body);
template <>
Result<IngestBegin> decode<IngestBegin>(ByteView body);
template <>
Result<IngestReady> decode<IngestReady>(ByteView body);
template <>
Result<IngestCommit> decode<IngestCommit>(ByteView body);
template <>
Result<IngestOk> decode<IngestOk>(ByteView body);

/// Like decode, for ingest_data; nothing is copied.
Result<IngestDataView> decode_ingest_data(ByteView body);

/// Splits a JSON document into the frames of admin_answer that carry it, the last one marked.
std::vector<Bytes> encode_answer(std::uint32_t id, std::string_view json);

}  // namespace pmcd::proto
