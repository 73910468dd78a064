// SPDX-License-Identifier: MIT
// One session's data channel as the dispatcher watches it: what of it is acknowledged, how fast it goes, how large its
// chunks are, and how much of them the kernel may hold unsent. It decides nothing about turns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "daemon/net/asio.h"
#include "daemon/net/channel.h"
#include "daemon/net/limits.h"
#include "daemon/net/pace.h"
#include "daemon/scheduler/speed_meter.h"

namespace pmcd::net {

/// So many bytes are enough under way to a client that takes `rate` bytes a second, as is guessed: what it takes in a
/// round trip and a quarter of a second, so that the guess can grow; two first chunks at least. Else a modem is sent,
/// at the speed of the uplink, what lies in front of its line for seconds.
std::size_t enough_under_way(double rate, scheduler::Time round_trip, std::size_t first_chunk_bytes);

/// The scheduler's time at a moment of the daemon's clock.
scheduler::Time scheduler_time(Clock::time_point time);
inline scheduler::Time scheduler_now() {
  return scheduler_time(Clock::now());
}

class DataLine {
 public:
  /// REQUIRES: both outlive it.
  DataLine(Channel& channel, const Limits& limits) : channel_(channel), limits_(limits) {}

  /// A chunk with so many payload bytes was queued and ends at channel.queued_position().
  void queued(std::size_t payload_bytes) { chunks_.push_back({channel_.queued_position(), payload_bytes}); }
  /// Payload bytes at the end of the queue were taken back before they left.
  void taken_back(std::size_t payload_bytes);

  struct News {
    scheduler::SpeedSample sample;
    std::uint64_t payload = 0;  ///< bytes acknowledged since the last look; a chunk counts when all of it is
  };
  /// What the kernel says now. [one or two system calls]
  News look(Clock::time_point now);
  /// Whether anything that was queued is not acknowledged, as far as was looked.
  [[nodiscard]] bool owes() const { return channel_.last_acknowledged() < channel_.queued_position(); }
  /// Whether all that was queued has left for the network. [one system call, if the channel has written all]
  [[nodiscard]] bool sent();

  /// For a client of that speed: a tenth of a second, within bounds; less is known of one that was not measured. Bounds
  /// what the kernel holds unsent accordingly.
  std::size_t chunk_bytes(std::optional<double> speed);

  /// Whether so much is under way to a client that was not measured, and is guessed to take `guess` bytes a second,
  /// that no more is to be sent where others want the uplink, too. [one system call]
  [[nodiscard]] bool has_enough(std::optional<double> guess);

  bool held_back = false;  ///< a transfer has more to send, and waits for acknowledgements
  Pace pace;
  Clock::time_point look_at;  ///< when to look next
  Duration pause{0};

 private:
  struct Chunk {
    std::uint64_t end = 0;  ///< position in the stream
    std::size_t payload = 0;
  };

  Channel& channel_;
  const Limits& limits_;
  std::deque<Chunk> chunks_;  ///< not acknowledged yet: as many as the kernel holds
  Clock::time_point info_at_;
  scheduler::Time round_trip_{0};
  std::size_t unsent_bound_ = 0;  ///< as told to the kernel; 0: never told
};

}  // namespace pmcd::net
