// SPDX-License-Identifier: MIT
// What the three loads share: connections to a daemon on loopback, opening a session step by step, and giving up. A
// load that meets anything but what it expects ends the program with a sentence: a benchmark of errors means nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/frame.h"
#include "proto/messages.h"

namespace pmcd::bench {

using Clock = std::chrono::steady_clock;

/// Prints the sentence and ends the program with exit code 1.
[[noreturn]] void fail(const std::string& text);

/// A socket that closes with the object.
class Socket {
 public:
  Socket() = default;
  explicit Socket(int fd) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(other.release()) {}
  Socket& operator=(Socket&& other) noexcept;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() { close(); }

  /// Connected to `port` of 127.0.0.1, from the loopback address number `source` of many: neither the daemon's limit
  /// for one address nor the number of free ports is what a load measures. Blocking, with a limit of 10 seconds.
  static Socket connect(std::uint16_t port, std::size_t source);

  /// All of `bytes`, which are few: a socket that does not take them at once is a failure.
  void send(proto::ByteView bytes) const;
  /// What is there, at least one byte; 0 at the end of the stream; none if nothing is there now.
  std::optional<std::size_t> receive(std::vector<std::byte>& into) const;
  void set_non_blocking() const;
  void close();
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int release();
  int fd_ = -1;
};

/// One channel, read frame by frame. Copies each frame; the data channel of fetch_run has a leaner reader.
class Link {
 public:
  Link() = default;
  explicit Link(Socket socket) : socket_(std::move(socket)) {}

  /// The next frame, its body valid until the next call; none if nothing more is there now (with a blocking socket:
  /// not within 10 seconds) or at the end of the stream, which at_end() tells.
  std::optional<proto::Frame> next(std::vector<std::byte>& buffer);
  [[nodiscard]] bool at_end() const { return at_end_; }
  [[nodiscard]] Socket& socket() { return socket_; }

 private:
  Socket socket_;
  proto::FrameReader frames_{proto::kMaxDataFrame};
  proto::Bytes pending_;  ///< received behind the frame that was given out
  std::size_t taken_ = 0;
  bool at_end_ = false;
};

/// The frame as a message of type M; another type, an error among them, ends the program.
template <typename M>
M expect(const std::optional<proto::Frame>& frame);

/// Both channels, joined, blocking.
struct OpenSession {
  Link requests;
  Link data;
};

OpenSession open_session(std::uint16_t request_port, std::size_t source);

proto::Bytes hello_frame();
proto::Bytes join_frame(const proto::Token& token);

/// What the frame is, for the sentence of fail(): its type, and an error's code and text.
std::string describe(const std::optional<proto::Frame>& frame);

template <typename M>
M expect(const std::optional<proto::Frame>& frame) {
  if (frame && frame->type == static_cast<std::uint16_t>(M::kType)) {
    auto message = proto::decode<M>(frame->body);
    if (message) return std::move(message).value();
    fail(message.error().detail);
  }
  fail(std::string("expected ") + proto::type_name(static_cast<std::uint16_t>(M::kType)) + ", got " + describe(frame));
}

}  // namespace pmcd::bench
