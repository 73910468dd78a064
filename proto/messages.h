// SPDX-License-Identifier: MIT
// The messages of the request and the data channel, one struct each. encode() gives the whole frame, length and type
// included; decode<M>() reads a frame's body. docs/PROTOCOL.md says what they mean; layouts stand beside the structs,
// little endian, str8/str16 = u8/u16 length and UTF-8 bytes, `rest` = all bytes to the end of the frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "proto/bytes.h"
#include "proto/codes.h"
#include "proto/frame.h"
#include "proto/result.h"

namespace pmcd::proto {

using Token = std::array<std::byte, 16>;  ///< 128 unguessable bits; good once, for kJoinSeconds

inline constexpr std::array<std::byte, 4> kMagic{std::byte{'P'}, std::byte{'M'}, std::byte{'C'}, std::byte{'D'}};
inline constexpr std::array<std::byte, 4> kAdminMagic{std::byte{'P'}, std::byte{'M'}, std::byte{'C'}, std::byte{'A'}};
inline constexpr std::uint16_t kDefaultRequestPort = 7621;
inline constexpr std::uint16_t kDefaultDataPort = 7622;
inline constexpr std::uint16_t kJoinSeconds = 30;
inline constexpr std::uint8_t kMaxOpenRequests = 8;
/// Meshes that a session may have open and that are of use.
inline constexpr std::uint32_t kMaxLiveHandles = 1'024;

/// u16 major, u16 minor. Whoever sends it sends its own highest; both then speak the lower minor.
struct Version {
  std::uint16_t major = kVersionMajor;
  std::uint16_t minor = kVersionMinor;
  bool operator==(const Version&) const = default;
};

/// magic "PMCD", Version, str8 agent (at most 64 bytes: name and version of the program, for the server's log).
struct Hello {
  static constexpr FrameType kType = FrameType::hello;
  Version version;
  std::string agent;
  bool operator==(const Hello&) const = default;
};

/// magic "PMCD", Version, 16 bytes token, u16 data port, u16 seconds the token is good, u8 open requests, str8 agent.
struct HelloOk {
  static constexpr FrameType kType = FrameType::hello_ok;
  Version version;
  Token token{};
  std::uint16_t data_port = kDefaultDataPort;
  std::uint16_t join_seconds = kJoinSeconds;
  std::uint8_t max_open_requests = kMaxOpenRequests;
  std::string agent;
  bool operator==(const HelloOk&) const = default;
};

/// magic "PMCD", Version, 16 bytes token.
struct Join {
  static constexpr FrameType kType = FrameType::join;
  Version version;
  Token token{};
  bool operator==(const Join&) const = default;
};

/// magic "PMCD", Version.
struct JoinOk {
  static constexpr FrameType kType = FrameType::join_ok;
  Version version;
  bool operator==(const JoinOk&) const = default;
};

/// u32 id (0: the session or connection), u16 code, str16 text (at most 512 bytes). The frame whose form never changes.
/// encode() makes the text printable; decode keeps the number of a code that it does not know.
struct ErrorMessage {
  static constexpr FrameType kType = FrameType::error;
  std::uint32_t id = 0;
  ErrorCode code = ErrorCode::internal_error;
  std::string text;
  bool operator==(const ErrorMessage&) const = default;
};

/// u32 id, any value: it comes back in the pong and is not an open request.
struct Ping {
  static constexpr FrameType kType = FrameType::ping;
  std::uint32_t id = 0;
  bool operator==(const Ping&) const = default;
};

/// u32 id.
struct Pong {
  static constexpr FrameType kType = FrameType::pong;
  std::uint32_t id = 0;
  bool operator==(const Pong&) const = default;
};

/// Empty body.
struct Goodbye {
  static constexpr FrameType kType = FrameType::goodbye;
  bool operator==(const Goodbye&) const = default;
};

/// u32 id (not 0), str8 filter, str8 after, u16 most. The answer is a transfer whose bytes are a page of the mesh list,
/// see mesh_list.h. decode accepts any filter and any `after` of at most 128 bytes: they are compared, never stored.
struct GetMeshList {
  static constexpr FrameType kType = FrameType::get_mesh_list;
  std::uint32_t id = 0;
  std::string filter{};    ///< a name is wanted if it contains this, ASCII letters compared without case; empty: all
  std::string after{};     ///< names bytewise greater than this only; empty: from the first on
  std::uint16_t most = 0;  ///< entries at most, 0: as many as the server puts on a page
  bool operator==(const GetMeshList&) const = default;
};

/// u32 id (not 0), str8 name. decode accepts any name of at most 128 bytes: whether it is one (is_mesh_name) is for
/// the server to answer with bad_name, which ends the request, not the session.
struct GetBaseMesh {
  static constexpr FrameType kType = FrameType::get_base_mesh;
  std::uint32_t id = 0;
  std::string name;
  bool operator==(const GetBaseMesh&) const = default;
};

/// u32 id (not 0), u32 handle (0: the mesh last asked for in this session).
struct GetNextPacket {
  static constexpr FrameType kType = FrameType::get_next_packet;
  std::uint32_t id = 0;
  std::uint32_t handle = 0;
  bool operator==(const GetNextPacket&) const = default;
};

/// u32 id (not 0), u64 generation, u32 packet, u64 offset: that packet of that content from that byte on.
struct GetPacket {
  static constexpr FrameType kType = FrameType::get_packet;
  std::uint32_t id = 0;
  std::uint64_t generation = 0;
  std::uint32_t packet = 0;
  std::uint64_t offset = 0;
  bool operator==(const GetPacket&) const = default;
};

/// u32 id (not 0): of the open request that is to end.
struct Cancel {
  static constexpr FrameType kType = FrameType::cancel;
  std::uint32_t id = 0;
  bool operator==(const Cancel&) const = default;
};

/// What a notice is about. decode keeps the number of a kind that it does not know: such a notice is skipped.
enum class NoticeKind : std::uint16_t {
  draining = 1,      ///< the server is ending: running transfers have `seconds` left, nothing new begins
  mesh_retired = 2,  ///< the mesh of `handle` was replaced or removed; the handle is good for `seconds` more
};

/// u16 kind, u32 handle (0: the session), u32 seconds, str16 text (at most 512 bytes, for people).
struct Notice {
  static constexpr FrameType kType = FrameType::notice;
  NoticeKind kind = NoticeKind::draining;
  std::uint32_t handle = 0;
  std::uint32_t seconds = 0;
  std::string text;
  bool operator==(const Notice&) const = default;
};

/// u32 id, u32 handle (not 0), u64 generation, rest: level directory as docs/FORMAT.md defines it
/// (codec::serialize(Directory)), 1 to kMaxDirectoryBytes bytes, not looked into here.
struct MeshOpened {
  static constexpr FrameType kType = FrameType::mesh_opened;
  std::uint32_t id = 0;
  std::uint32_t handle = 0;
  std::uint64_t generation = 0;
  Bytes directory;
  bool operator==(const MeshOpened&) const = default;
};

/// u32 id, u32 handle, u32 packet, u64 offset, u64 total; rest: 1 to kMaxChunkBytes bytes, offset + bytes <= total.
/// A mesh list travels with handle 0 and packet 0.
struct ChunkHeader {
  std::uint32_t id = 0;
  std::uint32_t handle = 0;
  std::uint32_t packet = 0;
  std::uint64_t offset = 0;
  std::uint64_t total = 0;
  bool operator==(const ChunkHeader&) const = default;
};
inline constexpr std::size_t kChunkHeaderBytes = kFrameHeaderBytes + 28;  ///< frame header included

struct ChunkView {
  ChunkHeader header;
  ByteView bytes;  ///< points into the body that was decoded
};

enum class TransferResult : std::uint8_t { complete = 0, cancelled = 1, failed = 2, end_of_mesh = 3 };

/// u32 id, u8 result, u16 code (0 unless failed: then why).
struct TransferEnd {
  static constexpr FrameType kType = FrameType::transfer_end;
  std::uint32_t id = 0;
  TransferResult result = TransferResult::complete;
  ErrorCode code = ErrorCode::none;
  bool operator==(const TransferEnd&) const = default;
};

/// "complete", "cancelled", "failed" or "end_of_mesh".
const char* result_name(TransferResult result);

Bytes encode(const Hello& message);
Bytes encode(const HelloOk& message);
Bytes encode(const Join& message);
Bytes encode(const JoinOk& message);
Bytes encode(const ErrorMessage& message);
Bytes encode(const Ping& message);
Bytes encode(const Pong& message);
Bytes encode(const Goodbye& message);
Bytes encode(const GetMeshList& message);
Bytes encode(const GetBaseMesh& message);
Bytes encode(const GetNextPacket& message);
Bytes encode(const GetPacket& message);
Bytes encode(const Cancel& message);
Bytes encode(const Notice& message);
Bytes encode(const MeshOpened& message);
Bytes encode(const TransferEnd& message);

/// The part of a chunk's frame before its payload, so that the payload is written from where it lies.
/// REQUIRES: 1 <= payload_bytes <= kMaxChunkBytes.
std::array<std::byte, kChunkHeaderBytes> encode_chunk_header(const ChunkHeader& header, std::uint32_t payload_bytes);

/// Reads the body of a frame whose type is M::kType. Never more and never less than the body: bytes left over are
/// malformed, except in hello, hello_ok, join and join_ok of a higher minor version, which may have added fields.
/// Errors: malformed; for the four versioned ones also bad_magic and unsupported_version (another major), judged first.
template <typename M>
Result<M> decode(ByteView body);
template <>
Result<Hello> decode<Hello>(ByteView body);
template <>
Result<HelloOk> decode<HelloOk>(ByteView body);
template <>
Result<Join> decode<Join>(ByteView body);
template <>
Result<JoinOk> decode<JoinOk>(ByteView body);
template <>
Result<ErrorMessage> decode<ErrorMessage>(ByteView body);
template <>
Result<Ping> decode<Ping>(ByteView body);
template <>
Result<Pong> decode<Pong>(ByteView body);
template <>
Result<Goodbye> decode<Goodbye>(ByteView body);
template <>
Result<GetMeshList> decode<GetMeshList>(ByteView body);
template <>
Result<GetBaseMesh> decode<GetBaseMesh>(ByteView body);
template <>
Result<GetNextPacket> decode<GetNextPacket>(ByteView body);
template <>
Result<GetPacket> decode<GetPacket>(ByteView body);
template <>
Result<Cancel> decode<Cancel>(ByteView body);
template <>
Result<Notice> decode<Notice>(ByteView body);
template <>
Result<MeshOpened> decode<MeshOpened>(ByteView body);
template <>
Result<TransferEnd> decode<TransferEnd>(ByteView body);

/// Like decode, for a chunk; nothing is copied.
Result<ChunkView> decode_chunk(ByteView body);

/// The id of a frame that cannot be decoded or is not known: its first four bytes, 0 when there are fewer. Every client
/// frame but hello, join and goodbye begins with its id, also in later minor versions, so unknown_type can name it.
std::uint32_t peek_id(ByteView body);

}  // namespace pmcd::proto
