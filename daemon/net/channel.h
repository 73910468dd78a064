// SPDX-License-Identifier: MIT
// One connection that speaks frames: reads them one by one with a deadline, queues what is to be written, and knows how
// far the peer has acknowledged it. The same class for request, data and admin channel; it does not know their
// messages. One coroutine reads and in the end calls finish(); anybody on the same thread may send().
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/limits.h"
#include "daemon/net/shared_bytes.h"
#include "proto/frame.h"

namespace pmcd::net {

class Channel : public std::enable_shared_from_this<Channel> {
 public:
  using Socket = StreamSocket;

  /// `read_buffer`: bytes taken from the socket at a time. REQUIRES: `limits` outlives the channel.
  Channel(Socket socket, const Limits& limits, std::uint32_t max_frame, std::size_t read_buffer);
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  struct Closed {};    ///< the peer closed, the line broke, or stop_reading() or abort() was called
  struct TimedOut {};  ///< no whole frame before the deadline; reading may go on
  using Incoming = std::variant<proto::Frame, proto::Error, Closed, TimedOut>;

  /// The next frame; its body is valid until the next call. After an Error the stream cannot be read further.
  awaitable<Incoming> read(std::optional<Clock::time_point> deadline = std::nullopt);
  /// Takes the deadline off the read() that is waiting.
  void lift_deadline() { read_deadline_.expires_at(Clock::time_point::max()); }
  /// Makes the waiting read() and all later ones answer Closed. What is queued is still written.
  void stop_reading();

  /// Queues a frame, which leaves at the end of this turn of the loop together with what else was queued in it; does
  /// nothing when the channel is closed.
  void send(proto::Bytes frame);
  /// Queues a frame whose end is a part of shared bytes, which are not copied. `tag`: for drop_tail.
  void send(proto::Bytes head, SharedBytes body, std::size_t offset, std::size_t size, std::uint64_t tag);
  /// Takes back the frames of `tag` that stand at the end of the queue and have not begun to leave. Returns how many
  /// shared bytes they had.
  std::size_t drop_tail(std::uint64_t tag);

  /// Whether less than limits.queued_bytes wait, in less than limits.queued_frames frames.
  [[nodiscard]] bool has_room() const {
    return queued_total_ - written_total_ < limits_.queued_bytes && queue_.size() < limits_.queued_frames;
  }
  /// Returns when there is room. False if the channel closed or is read no more, or nothing was written for
  /// limits.stall.
  awaitable<bool> room();
  /// Called, on the loop, after something was written; never from within send() or abort().
  void on_progress(std::function<void()> progress) { on_progress_ = std::move(progress); }

  /// Frames that wait to be written.
  [[nodiscard]] std::size_t queued_frames() const { return queue_.size(); }
  /// Bytes that wait to be written.
  [[nodiscard]] std::uint64_t unwritten() const { return queued_total_ - written_total_; }
  /// Bytes that were ever queued; what was queued last ends at this position of the stream.
  [[nodiscard]] std::uint64_t queued_position() const { return queued_total_; }
  /// The position up to which the peer's kernel has acknowledged. TCP only. One system call.
  [[nodiscard]] std::uint64_t acknowledged_position();
  /// How long the peer has owed an acknowledgement without giving any, as far as calls of this function could see; 0
  /// when it owes none.
  Duration owed_for(Clock::time_point now);
  /// What that was when it was asked last.
  [[nodiscard]] std::uint64_t last_acknowledged() const { return acknowledged_; }

  /// Writes what is queued, tells the peer that nothing follows, waits for its end, and closes; the whole at most
  /// limits.linger. Only the coroutine that reads may call it.
  awaitable<void> finish();
  /// Closes at once and forgets what is queued; what the kernel holds is still sent.
  void abort();
  /// The same, and the kernel forgets what it holds too.
  void reset();
  [[nodiscard]] bool is_open() const { return socket_.is_open(); }

  [[nodiscard]] int native_handle() { return socket_.native_handle(); }

 private:
  struct Piece {
    proto::Bytes head;
    SharedBytes body;
    std::size_t body_offset = 0;
    std::size_t body_size = 0;
    std::uint64_t tag = 0;
    std::size_t done = 0;  ///< of head and body together
    [[nodiscard]] std::size_t size() const { return head.size() + body_size; }
  };

  void enqueue(Piece piece);
  /// Writes what the socket takes, and asks to be called again when it takes more.
  void flush();
  void flush_when_writable();
  /// Writes from the front of the queue what the socket takes at once.
  std::size_t write_some(error_code& error);
  /// The first `count` bytes of the queue are written.
  void written(std::size_t count);
  /// Cancels what the socket waits for at `when`, unless the timer is cancelled or set anew before.
  void cancel_reads_at(Clock::time_point when);

  const Limits& limits_;
  Socket socket_;
  Timer read_deadline_;
  bool timed_out_ = false;
  bool reading_stopped_ = false;

  proto::FrameReader frames_;
  std::vector<std::byte> buffer_;
  proto::ByteView input_;  ///< of buffer_, not yet given to frames_

  std::deque<Piece> queue_;
  bool flush_is_due_ = false;  ///< a flush() is posted, or waits for the socket
  std::uint64_t queued_total_ = 0;
  std::uint64_t written_total_ = 0;
  std::uint64_t acknowledged_ = 0;
  std::uint64_t judged_ = 0;  ///< what was acknowledged when it was judged last
  std::optional<Clock::time_point> owed_since_;
  Condition progress_;  ///< something was written, or the channel closed
  std::function<void()> on_progress_;
};

}  // namespace pmcd::net
