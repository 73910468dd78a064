// SPDX-License-Identifier: MIT
// One client's data channel: what the daemon queued, how much of it its socket has taken, how much has left the socket,
// what is through the bottleneck, as positions in one stream. TCP is a window that doubles each round trip. It decides
// nothing and sets no timers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/links.h"
#include "sim/scenario.h"

namespace pmcd::sim {

/// Bytes a second of the stream that a link of so many kbit/s carries: segments of 1448 bytes in packets of 1500.
double goodput(double kbit);

/// Positions are in bytes of the stream, frame headers included.
class Channel {
 public:
  /// REQUIRES: `uplink` outlives it. The flow is added there.
  Channel(Uplink& uplink, const Line& line, const Tcp& tcp);

  struct Piece {
    double begin = 0, end = 0;
    double payload_before = 0, payload = 0;
    std::int32_t ends_packet = -1;
  };

  /// A chunk joins the stream: `payload` bytes behind a header, and with `tail` bytes of frames behind. `ends_packet`:
  /// the packet whose last chunk it is, or -1.
  void queue(double header, double payload, double tail, std::int32_t ends_packet, double now);
  /// The next piece that is through the bottleneck as a whole, which is taken out; none if there is none.
  std::optional<Piece> take_delivered();

  [[nodiscard]] double queued() const { return queued_; }
  [[nodiscard]] double delivered() const { return uplink_->position(flow_); }
  [[nodiscard]] double delivered_payload() const;
  [[nodiscard]] bool is_busy() const { return delivered() + kExact < queued_; }
  /// Whether the socket, which takes bytes while less than `unsent` of them wait in it, has taken all.
  [[nodiscard]] bool is_written(double unsent) const { return delivered() + room() + unsent + kExact >= queued_; }
  [[nodiscard]] bool has_left(double position) const { return delivered() + room() + kExact >= position; }
  /// Bytes a second at which it is delivered now; 0 where there is not enough to send for that to say anything.
  [[nodiscard]] double delivery_rate() const { return has_left(queued_) ? 0 : uplink_->rate(flow_); }

  /// Lets the flow move to whatever comes first: the end of the next piece, the end of the window's first burst, where
  /// all is written for somebody who waits (`unsent`), where `leaves` has left, or `stop_at`. Stops it if nothing is to
  /// be sent, or the client takes nothing any more.
  void go_on(std::optional<double> unsent, std::optional<double> leaves, std::optional<double> stop_at, double now);
  /// From now on it stays where it is.
  void freeze();

  /// The time has come at which the window's next round begins.
  void round_over(double now);
  /// When round_over() is to be called, if it is.
  [[nodiscard]] std::optional<double> next_round() const { return round_at_; }

  static constexpr double kExact = 1e-3;  ///< bytes; less is no difference

 private:
  [[nodiscard]] double room() const;
  [[nodiscard]] double enough_window() const;
  void set_cap();

  Uplink* uplink_;
  Uplink::Flow flow_;
  double down_;
  double round_trip_;
  Tcp tcp_;
  bool frozen_ = false;

  std::vector<Piece> pieces_;  ///< not yet through, few
  double queued_ = 0;
  double payload_ = 0;

  double window_;
  double burst_end_ = 0;  ///< up to here the first window of a stretch goes as fast as the line
  bool in_first_round_ = false;
  double idle_since_ = 0;
  std::optional<double> round_at_;
};

}  // namespace pmcd::sim
