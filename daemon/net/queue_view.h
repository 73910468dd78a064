// SPDX-License-Identifier: MIT
// The queue and its clients as an operator sees them: plain values of one moment. It changes nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/scheduler/request.h"

namespace pmcd::net {

struct RequestView {
  enum class State : std::uint8_t {
    running,
    waiting,
    blocked,  ///< cannot go now: interrupted until its client has taken what was queued for it, or behind another
              ///< request of its client that runs
  };
  State state = State::waiting;
  std::size_t rank = 0;  ///< among the waiting, 1 is next; 0 for those that do not wait
  scheduler::SessionKey client = 0;
  std::string address;
  std::string mesh;  ///< empty: a mesh list
  std::uint32_t packet = 0;
  std::uint64_t bytes = 0;
  std::uint64_t bytes_left = 0;
  double asked_seconds_ago = 0;
  double queued_seconds_ago = 0;
  std::string reason;
};

/// Running ones first, then interrupted ones, then the waiting in the order in which they would go now, then those that
/// are held back by others of their client.
struct QueueView {
  std::size_t waiting = 0;  ///< of all, blocked ones among them
  std::size_t running = 0;
  std::vector<RequestView> requests;
  std::size_t more = 0;  ///< that are left out
};

/// Leaves the first `most` requests, those of `client` and the one that is next; the others count as left out.
void shorten(QueueView& queue, std::size_t most, scheduler::SessionKey client);

struct ClientView {
  std::optional<double> speed;  ///< bytes a second
  double taking = 0;            ///< bytes a second over the last half second
  double weight = 1;
  std::uint64_t acknowledged = 0;  ///< payload bytes
  std::size_t waiting = 0;
  std::size_t running = 0;
};

/// A session as `clients` shows it.
struct SessionView {
  scheduler::SessionKey key = 0;
  std::string address;
  double connected_seconds = 0;
  std::optional<std::string> mesh;  ///< the one that was asked for last
  std::uint32_t level = 0;          ///< packets of it that are complete
  std::uint32_t levels = 0;
};

}  // namespace pmcd::net
