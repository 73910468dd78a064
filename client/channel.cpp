// SPDX-License-Identifier: MIT
// Reading and writing of one connection with Asio's callbacks.
#include "client/channel.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace pmcd::client {

using boost::system::error_code;

void Channel::start(OnFrame on_frame, OnHeard on_heard, OnEnd on_end) {
  on_frame_ = std::move(on_frame);
  on_heard_ = std::move(on_heard);
  on_end_ = std::move(on_end);
  error_code ignored;
  socket_.set_option(boost::asio::ip::tcp::no_delay(true), ignored);
  read();
}

void Channel::read() {
  socket_.async_read_some(boost::asio::buffer(buffer_), [this](const error_code& error, std::size_t size) {
    if (ended_) return;
    if (error == boost::asio::error::eof) {
      return end(
          reader_.mid_frame() ? "the server closed the connection within a frame" : "the server closed the connection",
          false);
    }
    if (error) return end(error.message(), false);
    on_heard_();
    proto::ByteView input(buffer_.data(), size);
    while (!input.empty() && !ended_) {
      const auto frame = reader_.next(input);
      if (!frame) return end(frame.error().detail, true);
      if (*frame) on_frame_(**frame);
    }
    if (!ended_) read();
  });
}

void Channel::send(proto::Bytes bytes) {
  if (ended_) return;
  outbox_.push_back(std::move(bytes));
  if (outbox_.size() == 1) write();
}

void Channel::write() {
  boost::asio::async_write(socket_, boost::asio::buffer(outbox_.front()), [this](const error_code& error, std::size_t) {
    if (ended_) return;
    // Reading notices the broken connection too, after what the server still had to say.
    if (error) return outbox_.clear();
    outbox_.pop_front();
    if (!outbox_.empty()) write();
  });
}

void Channel::send_last(const proto::Bytes& bytes) {
  if (ended_ || !outbox_.empty()) return;
  error_code ignored;
  socket_.non_blocking(true, ignored);
  socket_.write_some(boost::asio::buffer(bytes), ignored);
}

void Channel::end(const std::string& why, bool broken_frames) {
  close();
  on_end_(why, broken_frames);
}

void Channel::close() {
  ended_ = true;
  error_code ignored;
  socket_.close(ignored);
}

}  // namespace pmcd::client
