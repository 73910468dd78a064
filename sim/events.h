// SPDX-License-Identifier: MIT
// What will happen, in the order of time. It knows no clients and runs nothing.
#pragma once

#include <cstdint>
#include <queue>
#include <tuple>
#include <vector>

namespace pmcd::sim {

enum class What : std::uint8_t {
  connects,        ///< a client
  request_comes,   ///< to the daemon; value: packet
  packet_comes,    ///< to the client; value: packet
  packet_decoded,  ///< by the client; value: packet
  acknowledged,    ///< the oldest of what is on its way back to the daemon
  look,            ///< the daemon looks at what has been acknowledged
  round_over,      ///< of a channel's window
  turn_check,      ///< whether a turn is over that waits for its socket
  pump,            ///< the daemon tries whether there is a slot
  stall_check,     ///< whether a client has taken nothing for too long
  leaves,          ///< a client
};

struct Event {
  double at = 0;
  std::uint64_t number = 0;  ///< events of one moment happen in the order in which they were foreseen
  What what = What::connects;
  std::uint32_t client = 0;
  std::uint32_t value = 0;
};

class Events {
 public:
  void add(double at, What what, std::uint32_t client = 0, std::uint32_t value = 0) {
    queue_.push({at, next_++, what, client, value});
  }
  [[nodiscard]] bool empty() const { return queue_.empty(); }
  [[nodiscard]] double next_at() const { return queue_.top().at; }
  Event take() {
    const Event event = queue_.top();
    queue_.pop();
    return event;
  }
  [[nodiscard]] std::uint64_t count() const { return next_; }

 private:
  struct Later {
    bool operator()(const Event& a, const Event& b) const {
      return std::tie(a.at, a.number) > std::tie(b.at, b.number);
    }
  };
  std::priority_queue<Event, std::vector<Event>, Later> queue_;
  std::uint64_t next_ = 0;
};

}  // namespace pmcd::sim
