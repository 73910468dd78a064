// SPDX-License-Identifier: MIT
// The way of a client's packets: down through the uplink that all share and its own line, up through its line. Each of
// these is a Shaper; the line adds its delay. It knows no connections.
#pragma once

#include <functional>
#include <utility>

#include "sim/scenario.h"
#include "sim/shaper.h"
#include "sim/timeline.h"

namespace pmcd::sim {

/// Of a packet beside the payload of TCP: IPv4, and TCP with time stamps. The uplink's shaper counts Ethernet's too.
inline constexpr double kHeadBytes = 52;
inline constexpr double kEthernetBytes = 14;

class Path {
 public:
  using Step = Timeline::Step;

  /// REQUIRES: all outlive it.
  Path(Timeline& timeline, Shaper& uplink, const Line& line, double line_queue);

  /// An IP packet leaves the server. `has_left` is called when it is through the uplink, if it has to wait there: the
  /// answer is whether it does. `comes` is called when it is with the client: never, if a queue on the way is full.
  bool send_down(double ip_bytes, Step has_left, Step comes);
  void send_up(double ip_bytes, Step comes);
  /// The same for a short message alone on its connection, which is sent again when it was dropped.
  void tell_client(double ip_bytes, Step comes);
  void tell_server(double ip_bytes, Step comes);

  [[nodiscard]] double round_trip() const { return 2 * delay_; }

 private:
  /// When a packet that has left a shaper at `through` is on the other side: some process passes it on, in order.
  double passed_on(double through, double& last);

  Timeline* timeline_;
  Shaper* uplink_;
  Shaper down_, up_;
  double delay_;
  double last_down_ = 0, last_up_ = 0;
};

}  // namespace pmcd::sim
