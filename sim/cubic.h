// SPDX-License-Identifier: MIT
// How many packets a sender has under way: slow start with HyStart, then CUBIC (RFC 9438), as Linux does both. Told of
// acknowledgements and losses; it sends nothing.
#pragma once

#include <limits>
#include <optional>

namespace pmcd::sim {

class Cubic {
 public:
  /// Packets.
  [[nodiscard]] unsigned window() const { return window_; }
  [[nodiscard]] unsigned threshold() const { return threshold_; }
  [[nodiscard]] bool is_slow_start() const { return window_ < threshold_; }
  /// While a loss is made good the sender counts what may leave by itself.
  void set_window(unsigned packets) { window_ = packets; }

  /// `packets` were acknowledged, the last of them after `round_trip`; `round_is_over`: all that was under way when it
  /// was true last. `is_used`: the window kept the sender from sending more.
  void acknowledged(unsigned packets, double round_trip, bool round_is_over, bool is_used, double now);
  /// Something was lost: the threshold falls, and the window to it, or to one packet if nothing was heard for too long.
  void lost(bool timed_out);
  /// Nothing was sent for so long, several times the retransmission timeout.
  void idle(double seconds, double timeout);

  static constexpr unsigned kFirstWindow = 10;

 private:
  void hystart(double round_trip, bool round_is_over, double now);
  void avoid_congestion(unsigned packets, double now);

  static constexpr unsigned kNoThreshold = std::numeric_limits<unsigned>::max();
  unsigned window_ = kFirstWindow;
  unsigned threshold_ = kNoThreshold;
  unsigned counted_ = 0;  ///< acknowledged packets that have not yet made the window grow
  double least_round_trip_ = std::numeric_limits<double>::infinity();

  double round_since_ = 0, last_at_ = 0;
  double round_least_ = std::numeric_limits<double>::infinity();
  unsigned samples_ = 0;

  std::optional<double> epoch_;  ///< since the last loss, or the end of slow start
  double largest_ = 0;           ///< window before the last loss
  double origin_ = 0, to_origin_ = 0;
  double like_reno_ = 0;
};

}  // namespace pmcd::sim
