// SPDX-License-Identifier: MIT
// A client's stream as its turns watch it: what of it is acknowledged, how fast it goes, how large its chunks are, and
// how much of them the kernel may hold unsent. It decides nothing about turns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "daemon/scheduler/speed_meter.h"
#include "daemon/turns/limits.h"
#include "daemon/turns/pace.h"
#include "daemon/turns/stream.h"

namespace pmcd::turns {

/// So many bytes are enough under way to a client that takes `rate` bytes a second, as is guessed: what it takes in a
/// round trip and a quarter of a second, so that the guess can grow; two first chunks at least. Else a modem is sent,
/// at the speed of the uplink, what lies in front of its line for seconds.
std::size_t enough_under_way(double rate, Time round_trip, std::size_t first_chunk_bytes);

/// To a client of that speed, bytes a second: a tenth of a second, within bounds; less is known of one that was not
/// measured.
struct ChunkSize {
  std::size_t bytes = 0;
  std::size_t unsent_bytes = 0;  ///< that its kernel may hold
};
ChunkSize chunk_size(std::optional<double> speed, const Limits& limits);

class Line {
 public:
  /// REQUIRES: `stream` is not null; `limits` outlive it.
  Line(std::shared_ptr<Stream> stream, const Limits& limits) : stream_(std::move(stream)), limits_(limits) {}

  [[nodiscard]] Stream& stream() { return *stream_; }
  /// A chunk with so many payload bytes was queued and ends at stream().queued_position().
  void queued(std::size_t payload_bytes) { chunks_.push_back({stream_->queued_position(), payload_bytes}); }
  /// Payload bytes at the end of the queue were taken back before they left.
  void taken_back(std::size_t payload_bytes);

  struct News {
    scheduler::SpeedSample sample;
    std::uint64_t payload = 0;  ///< bytes acknowledged since the last look; a chunk counts when all of it is
  };
  /// What the kernel says now. [one or two system calls]
  News look(Time now);
  /// Whether anything that was queued is not acknowledged, as far as was looked.
  [[nodiscard]] bool owes() const { return stream_->last_acknowledged() < stream_->queued_position(); }
  /// Whether all that was queued has left for the network. [one system call, if all is written]
  [[nodiscard]] bool sent() { return stream_->unwritten() == 0 && stream_->has_left(); }

  /// As chunk_size(); bounds what the kernel holds unsent accordingly.
  std::size_t chunk_bytes(std::optional<double> speed);

  /// Whether so much is under way to a client that was not measured, and is guessed to take `guess` bytes a second,
  /// that no more is to be sent where others want the uplink, too. [one system call]
  [[nodiscard]] bool has_enough(std::optional<double> guess);

  bool held_back = false;  ///< a transfer has more to send, and waits for acknowledgements
  Pace pace;
  Time look_at{0};  ///< when to look next, while it is watched
  Time pause{0};

 private:
  struct Chunk {
    std::uint64_t end = 0;  ///< position in the stream
    std::size_t payload = 0;
  };

  std::shared_ptr<Stream> stream_;
  const Limits& limits_;
  std::deque<Chunk> chunks_;  ///< not acknowledged yet: as many as the kernel holds
  std::optional<Time> asked_kernel_at_;
  Time round_trip_{0};
  std::size_t unsent_bound_ = 0;  ///< as told to the kernel; 0: never told
};

}  // namespace pmcd::turns
