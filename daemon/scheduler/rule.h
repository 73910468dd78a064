// SPDX-License-Identifier: MIT
// The interface of a distribution rule: it is told what happens and answers who is next. A rule keeps its own order of
// the waiting requests and changes the key of a request only at an event of that request's own client, so that a choice
// costs O(log n); a rule that needs more says so. It touches no socket, no database and no clock, and never learns how
// many slots there are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/scheduler/clients.h"
#include "daemon/scheduler/request.h"

namespace pmcd::scheduler {

/// How a running transfer ended.
enum class Outcome : std::uint8_t {
  complete,  ///< the whole packet is with the client
  failed,    ///< it will not be tried again
  requeued,  ///< interrupted; the rest waits again (enqueued() follows with the new queued_at)
};

/// Bytes a second that stand for an uplink of which nothing is known: of the magnitude of real ones, so that times
/// reckoned with it can be compared with those reckoned later.
inline constexpr double kUnknownUplink = 100'000;

/// Who takes so much of the uplink may be no slower than it: two that share it show half of it each.
inline constexpr double kMayFill = 0.4;

/// What a rule may look at beside the request and its client, at an event. REQUIRES: outlives the rule.
struct Surroundings {
  const Clients& clients;
  double uplink = 0;  ///< bytes a second, as set or measured; 0: not known

  /// The speed with which a client's time is reckoned, bytes a second: its own, or as long as it is not measured the
  /// median of the measured ones, or the uplink's.
  [[nodiscard]] double expected_speed(const Client& client) const {
    if (client.speed) return *client.speed;
    if (const auto median = clients.median_speed()) return *median;
    return uplink > 0 ? uplink : kUnknownUplink;
  }
};

/// A waiting request and what the rule goes by, for people.
struct Ranked {
  RequestKey key = 0;
  std::string reason;
};

class Rule {
 public:
  Rule() = default;
  Rule(const Rule&) = delete;
  Rule& operator=(const Rule&) = delete;
  virtual ~Rule() = default;

  /// The name in the registry, for instance "fifo".
  [[nodiscard]] virtual std::string_view name() const = 0;

  /// `request` waits from now on; it stays where it is, with these values, until removed() has returned.
  virtual void enqueued(const Request& request, const Client& client, Time now) = 0;
  /// `request` waits no longer: it was taken, or its session is gone.
  virtual void removed(const Request& request) = 0;
  /// The waiting request that goes next; none if nothing waits. The same answer until the next event.
  [[nodiscard]] virtual std::optional<RequestKey> next() const = 0;
  /// The waiting requests in the order in which they would go if nothing happened from now on, at most `most` of them.
  [[nodiscard]] virtual std::vector<Ranked> ranking(std::size_t most, Time now) const = 0;

  /// Speed, acknowledged bytes or weight of `client` have changed; `waiting` are all its waiting requests.
  virtual void client_changed(const Client& /*client*/, std::span<const Request* const> /*waiting*/, Time /*now*/) {}
  /// `request` got a slot (removed() came before). A rule may note on it what it wants to know when that ends.
  virtual void started(Request& /*request*/, const Client& /*client*/, Time /*now*/) {}
  /// The running `request` gave its slot back; offset_bytes tells how far it has come. `waiting`: what of the same
  /// session waits at this moment.
  virtual void finished(const Request& /*request*/, const Client& /*client*/, Outcome /*outcome*/,
                        std::span<const Request* const> /*waiting*/, Time /*now*/) {}
  /// Nothing will come from `session` any more; its requests were removed or finished before.
  virtual void session_gone(SessionKey /*session*/, Time /*now*/) {}
};

}  // namespace pmcd::scheduler
