// SPDX-License-Identifier: MIT
// One connection of a session: frames out, frames in. Runs on the io_context of its session and on its thread; knows
// frames, but not what they mean. Not part of the library's public face.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include "proto/frame.h"

namespace pmcd::client {

class Channel {
 public:
  using OnFrame = std::function<void(const proto::Frame&)>;
  using OnHeard = std::function<void()>;
  /// Called once, when nothing can be read any more: why, in words; `broken_frames` if what came was no frame.
  using OnEnd = std::function<void(const std::string& why, bool broken_frames)>;

  Channel(boost::asio::io_context& io, std::uint32_t max_frame) : socket_(io), reader_(max_frame) {}
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  boost::asio::ip::tcp::socket& socket() { return socket_; }

  /// Starts reading. REQUIRES: connected, and the callbacks live as long as this object.
  void start(OnFrame on_frame, OnHeard on_heard, OnEnd on_end);
  /// Queues bytes; they leave when the io_context runs.
  void send(proto::Bytes bytes);
  /// Tries to send at once, without waiting, what fits into the socket; for the last word before closing.
  void send_last(const proto::Bytes& bytes);
  void close();
  [[nodiscard]] bool ended() const { return ended_; }
  /// What has come of a frame that is not whole, header included.
  [[nodiscard]] proto::ByteView unfinished() const { return reader_.unfinished(); }

 private:
  void read();
  void write();
  void end(const std::string& why, bool broken_frames);

  boost::asio::ip::tcp::socket socket_;
  proto::FrameReader reader_;
  std::array<std::byte, 64 * 1024> buffer_{};
  std::deque<proto::Bytes> outbox_;
  OnFrame on_frame_;
  OnHeard on_heard_;
  OnEnd on_end_;
  bool ended_ = false;
};

}  // namespace pmcd::client
