// SPDX-License-Identifier: MIT
// Reading and writing of frames on one socket. Writing is done at once as far as the socket takes it, and by a handler
// when it takes more, so that an idle connection costs one suspended reader.
#include "daemon/net/channel.h"

#include <algorithm>
#include <array>
#include <utility>

#include "daemon/net/socket_state.h"

namespace pmcd::net {
namespace {

/// Buffers that one write takes together: enough for a burst of short answers, little enough to keep on the stack.
constexpr std::size_t kMostParts = 16;

}  // namespace

Channel::Channel(Socket socket, const Limits& limits, std::uint32_t max_frame, std::size_t read_buffer)
    : limits_(limits),
      socket_(std::move(socket)),
      read_deadline_(socket_.get_executor()),
      frames_(max_frame),
      buffer_(read_buffer),
      progress_(socket_.get_executor()) {
  error_code ignored;
  socket_.non_blocking(true, ignored);
}

awaitable<Channel::Incoming> Channel::read(std::optional<Clock::time_point> deadline) {
  const auto self = shared_from_this();
  timed_out_ = false;
  if (deadline) cancel_reads_at(*deadline);
  while (is_open() && !reading_stopped_) {
    if (!input_.empty()) {
      auto next = frames_.next(input_);
      if (!next) {
        lift_deadline();
        co_return next.error();
      }
      if (next.value()) {
        lift_deadline();
        co_return *next.value();
      }
      continue;
    }
    if (timed_out_) co_return TimedOut{};
    error_code error;
    const std::size_t count = co_await socket_.async_read_some(asio::buffer(buffer_), resume_with(error));
    if (error == asio::error::operation_aborted) continue;
    if (error) break;
    input_ = proto::ByteView(buffer_).first(count);
  }
  lift_deadline();
  co_return Closed{};
}

void Channel::cancel_reads_at(Clock::time_point when) {
  read_deadline_.expires_at(when);
  read_deadline_.async_wait([self = shared_from_this()](const error_code& error) {
    // The deadline may have been lifted when this handler was queued already: then it is not meant any more.
    if (error || Clock::now() < self->read_deadline_.expiry()) return;
    self->timed_out_ = true;
    error_code ignored;
    self->socket_.cancel(ignored);
  });
}

void Channel::stop_reading() {
  reading_stopped_ = true;
  error_code ignored;
  socket_.cancel(ignored);
  progress_.notify();
}

void Channel::send(proto::Bytes frame) {
  enqueue({std::move(frame), nullptr, 0, 0, 0, 0});
}

void Channel::send(proto::Bytes head, SharedBytes body, std::size_t offset, std::size_t size, std::uint64_t tag) {
  enqueue({std::move(head), std::move(body), offset, size, tag, 0});
}

void Channel::enqueue(Piece piece) {
  if (!is_open()) return;
  queued_total_ += piece.size();
  queue_.push_back(std::move(piece));
  if (flush_is_due_) return;
  flush_is_due_ = true;
  asio::post(socket_.get_executor(), [self = shared_from_this()] { self->flush(); });
}

std::size_t Channel::drop_tail(std::uint64_t tag) {
  std::size_t dropped = 0;
  while (!queue_.empty() && queue_.back().tag == tag && queue_.back().done == 0) {
    dropped += queue_.back().body_size;
    queued_total_ -= queue_.back().size();
    queue_.pop_back();
  }
  return dropped;
}

void Channel::flush() {
  flush_is_due_ = false;
  while (is_open() && !queue_.empty()) {
    error_code error;
    const std::size_t count = write_some(error);
    if (error == asio::error::would_block || error == asio::error::try_again) {
      flush_when_writable();
      break;
    }
    if (error) {
      abort();
      return;
    }
    written(count);
  }
  progress_.notify();
  if (on_progress_) on_progress_();
}

void Channel::flush_when_writable() {
  flush_is_due_ = true;
  // A wait that is cancelled along with a read ends in another try.
  socket_.async_wait(Socket::wait_write, [self = shared_from_this()](const error_code&) { self->flush(); });
}

std::size_t Channel::write_some(error_code& error) {
  std::array<asio::const_buffer, kMostParts> parts;
  std::size_t used = 0;
  for (auto piece = queue_.begin(); piece != queue_.end() && used + 2 <= parts.size(); ++piece) {
    const std::size_t head_done = std::min(piece->done, piece->head.size());
    if (head_done < piece->head.size()) parts[used++] = asio::buffer(piece->head) + head_done;
    if (!piece->body) continue;
    parts[used++] =
        asio::buffer(piece->body->data() + piece->body_offset, piece->body_size) + (piece->done - head_done);
  }
  return socket_.write_some(parts, error);
}

void Channel::written(std::size_t count) {
  written_total_ += count;
  while (count > 0) {
    Piece& front = queue_.front();
    const std::size_t part = std::min(count, front.size() - front.done);
    front.done += part;
    count -= part;
    if (front.done == front.size()) queue_.pop_front();
  }
}

awaitable<bool> Channel::room() {
  const auto self = shared_from_this();
  std::uint64_t written = written_total_;
  Clock::time_point deadline = Clock::now() + limits_.stall;
  while (is_open() && !reading_stopped_ && !has_room()) {
    co_await progress_.wait_until(deadline);
    if (written_total_ != written) {
      written = written_total_;
      deadline = Clock::now() + limits_.stall;
    } else if (Clock::now() >= deadline) {
      co_return false;
    }
  }
  co_return is_open() && !reading_stopped_;
}

std::uint64_t Channel::acknowledged_position() {
  if (!is_open()) return acknowledged_;
  const std::uint64_t outstanding = unacknowledged_bytes(socket_.native_handle());
  // Never falls: bytes that reach the kernel between write and count must not look like a step back.
  if (outstanding <= written_total_) acknowledged_ = std::max(acknowledged_, written_total_ - outstanding);
  return acknowledged_;
}

Duration Channel::owed_for(Clock::time_point now) {
  const std::uint64_t acknowledged = acknowledged_position();
  const bool progress = acknowledged > judged_;
  judged_ = acknowledged;
  if (acknowledged == queued_total_) {
    owed_since_.reset();
    return Duration(0);
  }
  if (progress || !owed_since_) owed_since_ = now;
  return now - *owed_since_;
}

awaitable<void> Channel::finish() {
  const auto self = shared_from_this();
  Timer deadline(socket_.get_executor(), limits_.linger);
  deadline.async_wait([self](const error_code& error) {
    if (error) return;
    // Little may still reach a peer far away; much would stay in the kernel until it gives up, minutes later.
    const std::uint64_t owed = self->queued_position() - self->acknowledged_position();
    owed > self->limits_.queued_bytes ? self->reset() : self->abort();
  });
  while (is_open() && !queue_.empty()) co_await progress_.wait_until();
  error_code error;
  if (is_open()) socket_.shutdown(Socket::shutdown_send, error);
  // Unread bytes at close would reset the connection and could take the last frames with them: read on, forget.
  while (is_open() && !error) co_await socket_.async_read_some(asio::buffer(buffer_), resume_with(error));
  deadline.cancel();
  abort();
}

void Channel::reset() {
  error_code ignored;
  if (socket_.is_open()) socket_.set_option(Socket::linger(true, 0), ignored);
  abort();
}

void Channel::abort() {
  reading_stopped_ = true;
  read_deadline_.cancel();
  error_code ignored;
  if (!socket_.is_open()) return;
  socket_.close(ignored);
  queue_.clear();
  progress_.notify();
}

}  // namespace pmcd::net
