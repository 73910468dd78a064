// SPDX-License-Identifier: MIT
// What messages.cpp and admin.cpp share: building a frame field by field and judging a body that was read. Not part of
// the public face of proto.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "proto/frame.h"
#include "proto/messages.h"
#include "proto/result.h"
#include "proto/text.h"

namespace pmcd::proto {

using Magic = std::array<std::byte, 4>;

inline Error malformed(std::size_t where, std::string detail) {
  return {ErrorCode::malformed, where, std::move(detail)};
}

/// The value if the body was read exactly to its end, else malformed.
template <typename M>
Result<M> finish(const ByteReader& reader, M message) {
  const char* name = type_name(static_cast<std::uint16_t>(M::kType));
  if (reader.failed()) return malformed(reader.position(), std::string(name) + " is cut short");
  if (!reader.finished()) return malformed(reader.position(), std::string(name) + " has bytes after its last field");
  return message;
}

/// The same for a message of a peer that speaks `version`: a higher minor may have added fields.
template <typename M>
Result<M> finish_versioned(const ByteReader& reader, M message) {
  if (!reader.failed() && message.version.minor > kVersionMinor) return message;
  return finish(reader, std::move(message));
}

/// The same for a request, whose id must not be 0.
template <typename M>
Result<M> finish_request(const ByteReader& reader, M message) {
  if (!reader.failed() && message.id == 0) return malformed(0, "the id of a request is 0");
  return finish(reader, std::move(message));
}

/// A request whose only field is its id, which is not 0.
template <typename M>
Result<M> decode_id_only(ByteView body, bool zero_allowed) {
  ByteReader reader(body);
  M message;
  message.id = reader.u32();
  if (!reader.failed() && message.id == 0 && !zero_allowed) return malformed(0, "the id of a request is 0");
  return finish(reader, std::move(message));
}

template <typename M>
Bytes encode_id_only(const M& message) {
  ByteWriter writer;
  writer.u32(message.id);
  return make_frame(M::kType, writer.take());
}

/// Reads magic and version; an error if they are not the expected ones, judged as soon as they are there.
inline Result<Version> read_version(ByteReader& reader, const Magic& expected) {
  const auto magic = reader.array<4>();
  if (reader.failed()) return malformed(0, "the first frame is cut short");
  if (magic != expected) return Error{ErrorCode::bad_magic, 0, "the first frame does not begin with pmcd's magic"};
  Version version;
  version.major = reader.u16();
  version.minor = reader.u16();
  if (reader.failed()) return malformed(4, "the first frame is cut short");
  if (version.major != kVersionMajor) {
    return Error{ErrorCode::unsupported_version, 4,
                 "the peer speaks version " + std::to_string(version.major) + "." + std::to_string(version.minor) +
                     ", this side " + std::to_string(kVersionMajor) + "." + std::to_string(kVersionMinor)};
  }
  return version;
}

inline void write_version(ByteWriter& writer, const Magic& magic, const Version& version) {
  writer.bytes(magic);
  writer.u16(version.major);
  writer.u16(version.minor);
}

/// Reads an agent's name; false when it is too long or cannot be printed.
inline bool read_agent(ByteReader& reader, std::string& agent) {
  agent = reader.str8();
  return reader.failed() || (agent.size() <= kMaxAgentBytes && is_printable_utf8(agent));
}

inline void write_agent(ByteWriter& writer, const std::string& agent) {
  writer.str8(printable(agent, kMaxAgentBytes));
}

}  // namespace pmcd::proto
