// SPDX-License-Identifier: MIT
// A server that plays a script: it listens on two loopback ports and does exactly what the test says, right or wrong.
// Every wait of it ends after five seconds, so a test that goes wrong fails instead of hanging.
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "client/session.h"
#include "codec/packet/directory.h"
#include "codec/packet/header.h"
#include "proto/frame.h"
#include "proto/messages.h"

namespace pmcd::client::testing {

/// A listening or connected loopback socket that belongs to this object. Throws std::runtime_error on any failure: the
/// script's thread hands it to the test.
class Socket {
 public:
  explicit Socket(int fd) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Socket& operator=(Socket&& other) noexcept;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(); }

  static Socket listen();
  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] Socket accept() const;
  void send(proto::ByteView bytes) const;
  [[nodiscard]] bool readable_within(std::chrono::milliseconds time) const;
  /// Up to 4096 bytes; empty at the end of the stream.
  [[nodiscard]] proto::Bytes receive() const;
  void close();

 private:
  int fd_;
};

/// One connection of the mock, frame by frame.
class Line {
 public:
  explicit Line(Socket socket) : socket_(std::move(socket)), reader_(proto::kMaxClientFrame) {}

  template <typename M>
  void send(const M& message) {
    socket_.send(proto::encode(message));
  }
  void send_bytes(proto::ByteView bytes) { socket_.send(bytes); }
  void send_chunk(const proto::ChunkHeader& header, proto::ByteView bytes);

  /// The next frame, which must be an M.
  template <typename M>
  M expect() {
    const proto::Frame frame = next();
    if (frame.type != static_cast<std::uint16_t>(M::kType)) {
      throw std::runtime_error("the client sent frame type " + std::to_string(frame.type));
    }
    auto message = proto::decode<M>(frame.body);
    if (!message) throw std::runtime_error("the client sent a bad frame: " + message.error().detail);
    return std::move(message).value();
  }
  /// True when the client closed without another frame.
  bool closed();
  /// Whether the client sends anything in this time.
  bool speaks_within(std::chrono::milliseconds time);
  void close() { socket_.close(); }

 private:
  proto::Frame next();

  Socket socket_;
  proto::FrameReader reader_;
  proto::Bytes received_;
  proto::ByteView input_;
};

/// A mesh as a server holds it: real headers and a real directory around payloads that mean nothing.
struct MockMesh {
  std::vector<proto::Bytes> packets;
  proto::Bytes directory;
  std::uint64_t generation = 0x1234;
};
MockMesh mock_mesh(const std::vector<std::size_t>& payload_bytes);

class MockServer {
 public:
  struct Peer {
    Line request;
    Line data;
  };
  using Script = std::function<void(MockServer& server)>;

  /// Starts the script on a thread of its own.
  explicit MockServer(Script script);
  /// Waits for the script's end.
  ~MockServer() { finish(); }
  MockServer(const MockServer&) = delete;
  MockServer& operator=(const MockServer&) = delete;

  /// Waits for the script's end and gives what it threw, empty if nothing.
  std::string finish();

  [[nodiscard]] Address address() const { return {"127.0.0.1", request_port_}; }
  [[nodiscard]] std::uint16_t data_port() const { return data_port_; }

  // For scripts.
  Line accept_request() { return Line(request_listener_.accept()); }
  Line accept_data() { return Line(data_listener_.accept()); }
  /// A whole session set up the right way.
  Peer accept_session(std::uint8_t max_open_requests = proto::kMaxOpenRequests);
  /// get_base_mesh answered with the directory, then packet 0 in chunks of 100 bytes and its end. Gives the request's
  /// id.
  static std::uint32_t serve_base(Peer& peer, const MockMesh& mesh, std::uint32_t handle = 1);
  /// get_next_packet answered with packet `number`.
  static void serve_next(Peer& peer, const MockMesh& mesh, std::uint32_t number, std::uint32_t handle = 1);
  /// get_packet, which must be for this packet and offset, answered by mesh_opened (if `opens`) and the rest of it.
  static void serve_rest(Peer& peer, const MockMesh& mesh, std::uint32_t number, std::uint64_t offset,
                         bool opens = true, std::uint32_t handle = 1);
  /// The next frame, which must be such a get_packet; its id.
  static std::uint32_t expect_get_packet(Peer& peer, const MockMesh& mesh, std::uint32_t number, std::uint64_t offset);
  /// From byte `from` on, and the end.
  static void send_packet(Peer& peer, std::uint32_t id, const MockMesh& mesh, std::uint32_t number,
                          std::uint32_t handle = 1, std::size_t from = 0);
  /// The bytes from `from` to `to` only, in chunks of 100 bytes.
  static void send_part(Peer& peer, std::uint32_t id, const MockMesh& mesh, std::uint32_t number, std::size_t from,
                        std::size_t to, std::uint32_t handle = 1);

 private:
  Socket request_listener_ = Socket::listen();
  Socket data_listener_ = Socket::listen();
  std::uint16_t request_port_ = request_listener_.port();
  std::uint16_t data_port_ = data_listener_.port();
  std::string thrown_;
  std::thread thread_;
};

/// Options with time-outs that suit a test.
Options quick();

/// Connects, opens "m" and takes packets until the first error; that error.
Error first_error(MockServer& server, const Options& options = quick());

}  // namespace pmcd::client::testing
