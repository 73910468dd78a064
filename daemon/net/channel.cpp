// SPDX-License-Identifier: MIT
// Reading and writing of frames on one socket. Writing happens in a task of its own that lives only while there is
// something to write, so that an idle connection costs one suspended reader.
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

Channel::Channel(Socket socket, TaskGroup& tasks, const Limits& limits, std::uint32_t max_frame,
                 std::size_t read_buffer)
    : tasks_(tasks),
      limits_(limits),
      socket_(std::move(socket)),
      read_deadline_(tasks.executor()),
      frames_(max_frame),
      buffer_(read_buffer),
      progress_(tasks.executor()) {
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
  socket_.cancel(ignored);  // a write that is cancelled along with the read is started again
}

void Channel::send(proto::Bytes frame) {
  enqueue({std::move(frame), nullptr, 0, 0, 0});
}

void Channel::send(proto::Bytes head, SharedBytes body, std::size_t offset, std::size_t size) {
  enqueue({std::move(head), std::move(body), offset, size, 0});
}

void Channel::enqueue(Piece piece) {
  if (!is_open()) return;
  queued_total_ += piece.size();
  queue_.push_back(std::move(piece));
  if (flushing_) return;
  flushing_ = true;
  tasks_.spawn("writer", flush(shared_from_this()));
}

awaitable<void> Channel::flush([[maybe_unused]] std::shared_ptr<Channel> self) {
  while (is_open() && !queue_.empty()) {
    error_code error;
    const std::size_t count = co_await write_some(error);
    if (error == asio::error::operation_aborted) continue;
    if (error) {
      abort();
      break;
    }
    written(count);
    progress_.notify();
  }
  flushing_ = false;
  if (!is_open()) queue_.clear();
  progress_.notify();
}

awaitable<std::size_t> Channel::write_some(error_code& error) {
  std::array<asio::const_buffer, kMostParts> parts;
  std::size_t used = 0;
  for (auto piece = queue_.begin(); piece != queue_.end() && used + 2 <= parts.size(); ++piece) {
    const std::size_t head_done = std::min(piece->done, piece->head.size());
    if (head_done < piece->head.size()) parts[used++] = asio::buffer(piece->head) + head_done;
    if (!piece->body) continue;
    parts[used++] =
        asio::buffer(piece->body->data() + piece->body_offset, piece->body_size) + (piece->done - head_done);
  }
  co_return co_await socket_.async_write_some(parts, resume_with(error));
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
  while (is_open() && queued_total_ - written_total_ >= limits_.queued_bytes) {
    co_await progress_.wait_until(deadline);
    if (written_total_ != written) {
      written = written_total_;
      deadline = Clock::now() + limits_.stall;
    } else if (Clock::now() >= deadline) {
      co_return false;
    }
  }
  co_return is_open();
}

std::uint64_t Channel::acknowledged_position() {
  if (!is_open()) return acknowledged_;
  const std::uint64_t outstanding = unacknowledged_bytes(socket_.native_handle());
  // Never falls: bytes that reach the kernel between write and count must not look like a step back.
  if (outstanding <= written_total_) acknowledged_ = std::max(acknowledged_, written_total_ - outstanding);
  return acknowledged_;
}

awaitable<void> Channel::finish() {
  const auto self = shared_from_this();
  asio::steady_timer deadline(tasks_.executor(), limits_.linger);
  deadline.async_wait([self](const error_code& error) {
    if (!error) self->abort();
  });
  while (is_open() && !queue_.empty()) co_await progress_.wait_until();
  error_code error;
  if (is_open()) socket_.shutdown(Socket::shutdown_send, error);
  // Unread bytes at close would reset the connection and could take the last frames with them: read on, forget.
  while (is_open() && !error) co_await socket_.async_read_some(asio::buffer(buffer_), resume_with(error));
  deadline.cancel();
  abort();
}

void Channel::abort() {
  reading_stopped_ = true;
  read_deadline_.cancel();
  error_code ignored;
  if (socket_.is_open()) socket_.close(ignored);
  // flush() may hold a reference to the front piece while its write is being cancelled; it clears the rest itself.
  if (!flushing_) queue_.clear();
  progress_.notify();
}

}  // namespace pmcd::net
