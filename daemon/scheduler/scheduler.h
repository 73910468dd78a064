// SPDX-License-Identifier: MIT
// The one request queue of the daemon: requests wait here, the active rule says which goes next, and at most N of them
// hold a slot at a time. Pure bookkeeping: no socket, no database, no thread, no clock (the time is passed in, and the
// simulator links this very code). Used by one thread at a time. It moves no bytes: whoever takes a request sends it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "daemon/scheduler/request.h"
#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

class Scheduler {
 public:
  /// REQUIRES: rule not null, slots >= 1.
  Scheduler(std::unique_ptr<Rule> rule, std::size_t slots);

  /// `request` joins the queue with the asked_at that the caller set; queued_at becomes the same. False, and nothing
  /// happens, if the key is already waiting or running. [O(log n)]
  bool enqueue(Request request);

  /// A waiting request leaves the queue. False if it does not wait (unknown, or already running). [O(log n)]
  bool withdraw(RequestKey key);

  /// The request that the rule puts next, which now holds a slot; none if all slots are taken or nothing waits.
  /// [O(log n)]
  std::optional<Request> take(Time now);

  /// The client acknowledged `bytes` more of a running request. No effect if it does not run.
  void progressed(RequestKey key, std::uint64_t bytes, Time now);

  /// A running request ends for good and its slot is free. False if it does not run. [O(log n)]
  bool complete(RequestKey key, Time now);
  bool fail(RequestKey key, Time now);

  /// A running request goes back to the queue with what remains from `offset_bytes` on; asked_at stays, queued_at is
  /// `now`. False if it does not run, or if nothing would remain. [O(log n)]
  bool requeue(RequestKey key, std::uint64_t offset_bytes, Time now);

  /// Everything of `session` leaves: its waiting requests are withdrawn, its running ones fail and free their slots.
  /// Returns the keys of all of them, ascending. [O(k log n) for k requests of that session]
  std::vector<RequestKey> remove_session(SessionKey session, Time now);

  [[nodiscard]] std::size_t waiting() const { return requests_.size() - running_; }
  [[nodiscard]] std::size_t running() const { return running_; }
  [[nodiscard]] std::size_t slots() const { return slots_; }
  [[nodiscard]] std::string_view rule_name() const { return rule_->name(); }

 private:
  struct Entry {
    Request request;
    bool running = false;
  };
  using Entries = std::unordered_map<RequestKey, Entry>;

  bool finish(RequestKey key, Outcome outcome, Time now);
  Entries::iterator find_running(RequestKey key);
  void forget(Entries::iterator it);

  std::unique_ptr<Rule> rule_;
  std::size_t slots_;
  std::size_t running_ = 0;
  Entries requests_;
  /// The requests of a session, waiting or running: a handful each, because the network bounds what a session may open.
  std::unordered_map<SessionKey, std::vector<RequestKey>> by_session_;
};

}  // namespace pmcd::scheduler
