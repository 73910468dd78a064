// SPDX-License-Identifier: MIT
// A client of the daemon that does only what a test tells it, right or wrong: blocking sockets with deadlines and the
// frames of proto/. A peer that does not answer in time is a test failure, never a hang.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "proto/admin.h"
#include "proto/frame.h"
#include "proto/messages.h"
#include "tests/store/fake_mesh.h"

namespace pmcd::test {

inline constexpr std::chrono::milliseconds kPatience{10'000};

/// A frame with bytes of its own.
struct RawFrame {
  std::uint16_t type = 0;
  proto::Bytes body;
  [[nodiscard]] bool is(proto::FrameType wanted) const { return type == static_cast<std::uint16_t>(wanted); }
};

class RawConnection {
 public:
  RawConnection() = default;
  explicit RawConnection(int fd) : fd_(fd) {}
  RawConnection(RawConnection&& other) noexcept;
  RawConnection& operator=(RawConnection&& other) noexcept;
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;
  ~RawConnection() { close(); }

  /// Connections to loopback; a failure fails the test and gives a closed connection.
  static RawConnection tcp(std::uint16_t port, int receive_buffer = 0);
  static RawConnection local(const std::string& path);

  /// False if the peer has closed.
  bool send(proto::ByteView bytes);
  /// The next frame; none at the end of the stream, or (with a test failure) if nothing comes in time.
  std::optional<RawFrame> read(std::chrono::milliseconds patience = kPatience);
  /// From now on read() takes from the socket only so often: 64 KiB at most each time.
  void read_every(std::chrono::microseconds pause) { pause_ = pause; }
  /// Whether the peer closes the connection in time; frames before the end are skipped.
  bool closes(std::chrono::milliseconds patience = kPatience);
  /// Whether anything, a frame or the end, comes within `time`.
  bool stirs(std::chrono::milliseconds time);
  void close();
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_ = -1;
  proto::FrameReader frames_{proto::kMaxAdminFrame};
  proto::Bytes buffer_;
  proto::ByteView input_;
  std::chrono::microseconds pause_{0};
};

/// The next frame as a message of type M; a failure fails the test and gives an empty message.
template <typename M>
M expect(RawConnection& connection) {
  const auto frame = connection.read();
  if (!frame) {
    ADD_FAILURE() << "the connection ended instead of " << proto::type_name(static_cast<std::uint16_t>(M::kType));
    return {};
  }
  if (!frame->is(M::kType)) {
    std::string what = proto::type_name(frame->type) != nullptr ? proto::type_name(frame->type) : "an unknown type";
    if (frame->is(proto::FrameType::error)) {
      const auto error = proto::decode<proto::ErrorMessage>(frame->body);
      if (error) what += " " + std::string(proto::code_name(error.value().code)) + ": " + error.value().text;
    }
    ADD_FAILURE() << "expected " << proto::type_name(static_cast<std::uint16_t>(M::kType)) << ", got " << what;
    return {};
  }
  auto message = proto::decode<M>(frame->body);
  if (!message) {
    ADD_FAILURE() << message.error().detail;
    return {};
  }
  return std::move(message).value();
}

/// The next frame must be an error; its code by name, and `id` if asked for.
std::string expect_error(RawConnection& connection, std::optional<std::uint32_t> id = std::nullopt);

/// The next frame must be a notice of this kind; the notice.
proto::Notice expect_notice(RawConnection& connection, proto::NoticeKind kind);

/// What a transfer brought.
struct RawTransfer {
  std::uint32_t id = 0;
  std::uint32_t handle = 0;
  std::uint32_t packet = 0;
  proto::TransferResult result = proto::TransferResult::failed;
  proto::Bytes bytes;
  std::size_t chunks = 0;
};

/// Both channels, joined.
struct RawSession {
  RawConnection requests;
  RawConnection data;

  /// Receive buffers of the data and the request channel, in bytes; 0 leaves them to the kernel.
  static RawSession open(std::uint16_t request_port, int receive_buffer = 0, int request_buffer = 0);

  /// Reads chunks until some transfer ends, checks that they are in order and without gaps, and returns that transfer.
  RawTransfer next_transfer();
  /// Opens a mesh and returns mesh_opened; the base packet's transfer is still to be read.
  proto::MeshOpened open_mesh(std::uint32_t id, const std::string& name);
  /// Fetches all packets of a mesh, one request at a time, up to end_of_mesh.
  std::vector<proto::Bytes> fetch(const std::string& name);

 private:
  std::map<std::uint32_t, RawTransfer> under_way_;
};

/// An admin connection after its hello.
struct RawAdmin {
  RawConnection connection;

  static RawAdmin open(const std::string& path);
  /// The whole answer to a request, or "error: <code name>".
  std::string answer(const proto::Bytes& request);
  /// The same to one that was sent before.
  std::string read_answer();
  /// Ingests; "ok", "replaced", an error's code name, or "lost" if the connection ended.
  std::string ingest(const std::string& name, const FakeMesh& mesh, bool replace = false, std::size_t piece = 100'000);
};

}  // namespace pmcd::test
