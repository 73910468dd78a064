// SPDX-License-Identifier: MIT
// The data connection from the server to one client, segment by segment: what the server's kernel sends, holds and
// sends again, and what the client's kernel hands on and acknowledges. After Linux: CUBIC, SACK with RACK, tail loss
// probes, small queues (TSQ). The handshake and the way up are not in here.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>

#include "sim/cubic.h"
#include "sim/path.h"

namespace pmcd::sim {

/// Positions are in bytes of the stream.
class Connection {
 public:
  /// `window`: what the client's kernel takes without anybody reading it. REQUIRES: all outlive it.
  Connection(Timeline& timeline, Path& path, double window);
  Connection(const Connection&) = delete;

  /// More has come to the client in order, up to this position at least; called only while the client reads.
  std::function<void(std::uint64_t position)> on_data;
  /// The socket takes more than it did.
  std::function<void()> on_writable;

  /// The program writes; returns how much of it the socket takes while it holds fewer than `unsent_bound` bytes that
  /// were not sent.
  std::uint64_t write(std::uint64_t bytes, std::uint64_t unsent_bound);
  /// Calls on_writable once it would take a good part of the bound.
  void call_when_writable(std::uint64_t unsent_bound);
  /// The client reads no more.
  void stop_reading() { reads_ = false; }
  /// Nothing of it happens any more.
  void reset();

  [[nodiscard]] std::uint64_t written() const { return written_; }
  [[nodiscard]] std::uint64_t acknowledged() const { return acknowledged_; }
  [[nodiscard]] std::uint64_t sacked() const;
  [[nodiscard]] std::uint64_t unsent() const { return written_ - sent_; }

  /// As TCP_INFO says it: bytes a second, and whether the program had left it idle.
  [[nodiscard]] double delivery_rate() const { return rate_; }
  [[nodiscard]] bool is_application_limited() const { return rate_is_limited_; }
  [[nodiscard]] double least_round_trip() const { return least_round_trip_; }
  [[nodiscard]] double last_acknowledgement() const { return acknowledged_at_; }

  static constexpr std::uint64_t kSegment = 1448;

 private:
  struct Segment {
    std::uint64_t begin = 0, end = 0;
    double sent_at = 0;
    std::uint64_t order = 0;  ///< of its last transmission
    unsigned transmissions = 0;
    bool sacked = false, lost = false;
    // What the rate of delivery is worked out from.
    std::uint64_t delivered = 0;
    double delivered_at = 0, first_sent_at = 0;
    bool limited = false;
  };

  void push();
  [[nodiscard]] bool may_send(std::uint64_t bytes) const;
  void transmit(Segment& segment);
  void comes(std::uint64_t begin, std::uint64_t end);
  void acknowledge(std::uint64_t up_to, std::uint64_t begin, std::uint64_t window_end);
  void note_rate(const Segment& newest);
  /// Marks what must be lost, since what was sent later has come; whether there is any. Comes back by itself for what
  /// may only be late (RACK).
  bool find_lost();
  void begin_recovery(bool timed_out);
  void count_out(unsigned delivered, unsigned least);
  void note_window_use(bool limited);
  void set_timer();
  void timer_is_over();
  [[nodiscard]] double timeout() const;

  Timeline* timeline_;
  Path* path_;
  Cubic cubic_;

  std::uint64_t written_ = 0, sent_ = 0, acknowledged_ = 0;
  std::uint64_t window_end_;
  std::deque<Segment> flight_;
  unsigned in_flight_ = 0;  ///< neither acknowledged nor lost
  unsigned sacked_ = 0, lost_ = 0;
  std::uint64_t in_uplink_ = 0;  ///< memory of the packets in the server's own queue
  std::uint64_t order_ = 0, newest_delivered_ = 0;

  double smoothed_ = 0, deviation_ = 0;
  double least_round_trip_ = std::numeric_limits<double>::infinity();
  double last_round_trip_ = 0;
  double newest_round_trip_ = 0;  ///< of the segment that was sent last of those that have come
  double sent_at_ = 0, acknowledged_at_ = 0;
  unsigned backoff_ = 0;
  std::uint64_t timer_ = 0;  ///< the last one that was set

  std::uint64_t recovery_end_ = 0;
  unsigned before_loss_ = 0, delivered_since_ = 0, sent_since_ = 0;

  unsigned most_in_flight_ = 0;
  std::uint64_t use_end_ = 0, round_end_ = 0;

  std::uint64_t delivered_ = 0;  ///< packets
  double delivered_at_ = 0, first_sent_at_ = 0;
  std::uint64_t limited_until_ = 0;
  double rate_ = 0;

  std::uint64_t writable_bound_ = 0;  ///< somebody waits; 0: nobody

  // The client's side.
  double window_;
  std::uint64_t received_ = 0;
  std::uint64_t read_ = 0;
  std::uint64_t told_ = 0;                        ///< position that on_data knows of, or soon will
  std::map<std::uint64_t, std::uint64_t> apart_;  ///< came before what is in front of it

  bool gone_ = false;
  bool probe_is_next_ = false, probed_ = false;
  bool recovers_ = false;
  bool is_limited_ = false;  ///< by the window
  bool rate_is_limited_ = false;
  bool reads_ = true;  ///< the client
};

}  // namespace pmcd::sim
