// SPDX-License-Identifier: MIT
// Frames: u32 length of what follows, u16 type, body; little endian. The types of all channels, the limits of each
// direction, and a reader that takes a stream apart without ever holding more than one frame. No socket here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "proto/bytes.h"
#include "proto/result.h"

namespace pmcd::proto {

/// Same major number: must work together. Both sides speak the lower of the two minors.
inline constexpr std::uint16_t kVersionMajor = 1;
inline constexpr std::uint16_t kVersionMinor = 0;

// Part of the protocol: never change or reuse a number. A number that is not here is answered unknown_type.
// Kept free for later minor versions: 0x0150-0x015f on the admin channel.
enum class FrameType : std::uint16_t {
  hello = 0x0001,            ///< client, request channel, first frame
  hello_ok = 0x0002,         ///< server's answer to it
  error = 0x0003,            ///< server, any channel; this frame's form never changes, in any version
  ping = 0x0004,             ///< client, request and admin channel
  pong = 0x0005,             ///< server's answer to it
  goodbye = 0x0006,          ///< client, request and admin channel; the server closes
  join = 0x0007,             ///< client, data channel, first frame
  join_ok = 0x0008,          ///< server's answer to it, on the data channel
  notice = 0x0009,           ///< server, request channel: what nobody asked for but should know
  get_mesh_list = 0x0010,    ///< client, request channel
  get_base_mesh = 0x0011,    ///< client, request channel
  get_next_packet = 0x0012,  ///< client, request channel
  get_packet = 0x0013,       ///< client, request channel: from an offset on, also in a new session
  cancel = 0x0014,           ///< client, request channel
  mesh_opened = 0x0020,      ///< server, request channel: first answer to get_base_mesh, sometimes to get_packet
  chunk = 0x0030,            ///< server, data channel
  transfer_end = 0x0031,     ///< server, data channel

  admin_hello = 0x0101,     ///< operator, first frame
  admin_hello_ok = 0x0102,  ///< daemon's answer to it
  admin_list = 0x0110,
  admin_show = 0x0111,
  admin_remove = 0x0112,
  admin_status = 0x0113,
  ingest_begin = 0x0120,
  ingest_ready = 0x0121,  ///< daemon: the name is free, send the packets
  ingest_data = 0x0122,
  ingest_commit = 0x0123,
  ingest_ok = 0x0124,     ///< daemon: committed
  admin_answer = 0x0130,  ///< daemon: JSON text, in pieces
  admin_rules = 0x0140,
  admin_rule = 0x0141,
  admin_set_rule = 0x0142,
  admin_history = 0x0143,
  admin_revert = 0x0144,
  admin_queue = 0x0145,
  admin_clients = 0x0146,
  admin_explain = 0x0147,
  admin_weight = 0x0148,
};

/// The name as written above, or nullptr for a number that is no type.
const char* type_name(std::uint16_t type);

inline constexpr std::size_t kLengthBytes = 4;
inline constexpr std::size_t kTypeBytes = 2;
inline constexpr std::size_t kFrameHeaderBytes = kLengthBytes + kTypeBytes;

// Highest value of the length field that a receiver accepts.
inline constexpr std::uint32_t kMaxClientFrame = 4096;        ///< client to server, request and data channel
inline constexpr std::uint32_t kMaxAnswerFrame = 512 * 1024;  ///< server to client, request channel
inline constexpr std::uint32_t kMaxDataFrame = 512 * 1024;    ///< server to client, data channel
inline constexpr std::uint32_t kMaxAdminFrame = 1024 * 1024;  ///< admin channel, both ways

inline constexpr std::uint32_t kMaxChunkBytes = 256 * 1024;      ///< payload of a chunk, ingest_data, admin_answer
inline constexpr std::uint32_t kMaxDirectoryBytes = 256 * 1024;  ///< level directory of one mesh

struct Frame {
  std::uint16_t type = 0;  ///< may be no FrameType at all
  ByteView body;           ///< points into the FrameReader: valid until its next call
};

/// Takes a byte stream apart. Holds at most one frame, grows with the bytes that came (never with the length that a
/// header claims), and gives memory beyond 4 KiB back when a frame was taken. One thread at a time.
class FrameReader {
 public:
  /// `max_length`: highest length field accepted (one of the kMax...Frame constants).
  explicit FrameReader(std::uint32_t max_length) : max_length_(max_length) {}

  /// Takes bytes off the front of `input` until one frame is whole and returns it; nullopt when the input is used up
  /// before. Call again while `input` is not empty.
  /// Errors: frame_too_long (as soon as the length is known), malformed (length below 2). After an error the stream
  /// cannot be read further and every later call gives the same error.
  Result<std::optional<Frame>> next(ByteView& input);

  /// True when some but not all bytes of a frame have come: the stream must not end here.
  [[nodiscard]] bool mid_frame() const;

  /// The bytes of a frame that is not whole yet, its length and type included; empty between frames. So a receiver can
  /// save what a lost line brought of a long frame. Valid until the next call of next().
  [[nodiscard]] ByteView unfinished() const;

 private:
  std::uint32_t max_length_;
  Bytes buffer_;
  bool taken_ = false;  ///< buffer_ holds a frame that was given out
  std::optional<Error> failed_;
};

/// A whole frame from type and body. REQUIRES: body.size() <= 2^32 - 3.
Bytes make_frame(FrameType type, ByteView body);

}  // namespace pmcd::proto
