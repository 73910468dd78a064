// SPDX-License-Identifier: MIT
// A scheduler in virtual time, for tests: clients that ask, are measured and acknowledge, and the order in which they
// are served. It moves the clock only when told to.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/scheduler/mesh_profile.h"
#include "daemon/scheduler/scheduler.h"

namespace pmcd::scheduler {

using std::chrono::milliseconds;
using std::chrono::seconds;

inline Policy policy_of(std::string rule, RuleOptions options = {}, std::optional<std::size_t> slots = 1) {
  Policy policy;
  policy.rule = std::move(rule);
  policy.rule_options = std::move(options);
  policy.slots = slots;
  return policy;
}

/// Whether the queue took a request that is asked at this moment.
inline bool enqueue(Scheduler& scheduler, const Request& request) {
  return scheduler.enqueue(request, request.asked_at);
}

class Driver {
 public:
  explicit Driver(Policy policy) : scheduler(std::move(policy)) {}

  /// A request that joins now; its key.
  RequestKey ask(SessionKey session, std::uint64_t bytes, std::uint64_t rest = 0, MeshKey mesh = 1,
                 std::uint32_t packet = 0, std::shared_ptr<const MeshProfile> profile = nullptr) {
    Request request;
    request.key = ++last_key_;
    request.session = session;
    request.mesh = mesh;
    request.packet = packet;
    request.size_bytes = bytes;
    request.rest_bytes = rest;
    request.profile = std::move(profile);
    request.asked_at = now;
    if (!scheduler.enqueue(request, now)) return 0;
    return request.key;
  }

  /// Long unbroken sending at exactly that speed; the clock goes on.
  void measure(SessionKey session, std::uint64_t bytes_a_second) {
    std::uint64_t& position = positions_[session];
    scheduler.observe(session, {now, position, true, 0, Time{0}}, now);
    for (int n = 0; n < 20; ++n) {
      now += seconds(1);
      position += bytes_a_second;
      scheduler.observe(session, {now, position, n < 19, 0, Time{0}}, now);
    }
  }

  /// The key that goes next, which holds a slot now; 0: none.
  RequestKey take() {
    const auto taken = scheduler.take(now);
    return taken ? taken->key : 0;
  }

  /// One after the other to the end, in no time.
  std::vector<RequestKey> serve_all() {
    std::vector<RequestKey> order;
    while (const RequestKey key = take()) {
      order.push_back(key);
      scheduler.complete(key, now);
    }
    return order;
  }

  Scheduler scheduler;
  Time now{0};

 private:
  RequestKey last_key_ = 0;
  std::map<SessionKey, std::uint64_t> positions_;
};

using Keys = std::vector<RequestKey>;

}  // namespace pmcd::scheduler
