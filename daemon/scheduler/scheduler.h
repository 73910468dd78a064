// SPDX-License-Identifier: MIT
// The one request queue of the daemon: requests wait here, the active rule says which goes next, and as many as the
// policy allows hold a slot at a time. Pure bookkeeping: no socket, no database, no thread, no clock (the time is
// passed in, and the simulator links this very code). Used by one thread at a time. It moves no bytes: whoever takes a
// request sends it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/scheduler/clients.h"
#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/load.h"
#include "daemon/scheduler/policy.h"
#include "daemon/scheduler/request.h"
#include "daemon/scheduler/rule.h"
#include "daemon/scheduler/sorted_blocks.h"
#include "daemon/scheduler/uplink_meter.h"

namespace pmcd::scheduler {

/// REQUIRES of all functions with a `now`: it never falls.
class Scheduler {
 public:
  /// REQUIRES: the policy's rule exists and has these options.
  explicit Scheduler(Policy policy);
  Scheduler(Scheduler&&) = delete;

  /// `request` joins the queue with the asked_at that the caller set; queued_at becomes the same. False, and nothing
  /// happens, if the key is already known. [O(log n)]
  bool enqueue(Request request, Time now);

  /// A waiting or parked request leaves. False if it is neither (unknown, or running). [O(log n)]
  bool withdraw(RequestKey key);

  /// The request that goes next; none if all slots are taken or nothing waits. `taken_slots`: slots that the caller
  /// holds for other things. [O(1); with slots=auto O(running), at most twenty times a second]
  [[nodiscard]] std::optional<RequestKey> due(Time now, std::size_t taken_slots = 0) const;
  /// It holds a slot now. Want of memory leaves it so: then its session is to be removed. REQUIRES: it is due.
  /// [O(log n)]
  Request begin(RequestKey key, Time now);
  /// Both.
  std::optional<Request> take(Time now, std::size_t taken_slots = 0);

  /// What is known of a client's data channel now: how fast it takes what it is sent. [O(log n), and where its
  /// speed has changed as acknowledged()]
  void observe(SessionKey session, const SpeedSample& sample, Time now);
  /// The client has acknowledged so many payload bytes more. [O(k log n) for k waiting requests of that client, and
  /// what the rule says of its key]
  void acknowledged(SessionKey session, std::uint64_t payload_bytes, Time now);
  /// The operator gives a client another share. REQUIRES: weight > 0.
  void set_weight(SessionKey session, double weight, Time now);

  /// A running request ends for good and its slot is free, with all its bytes sent, or all before `offset_bytes`. False
  /// if it does not run. [O(log n)]
  bool complete(RequestKey key, Time now);
  bool fail(RequestKey key, std::uint64_t offset_bytes, Time now);

  /// A running request goes back to the queue with what remains from `offset_bytes` on; asked_at stays, queued_at is
  /// `now`. False if it does not run, or if nothing would remain. [O(log n)]
  bool requeue(RequestKey key, std::uint64_t offset_bytes, Time now);

  /// The first chunk of a running request's turn leaves now: its quantum counts from here.
  void turn_begins(RequestKey key, Time now);
  /// Whether the turn of a running request is over: it has lasted for the quantum, and others wait or, with slots=auto,
  /// share a full uplink with it.
  [[nodiscard]] bool quantum_is_over(RequestKey key, Time now) const;
  /// At a chunk boundary, when quantum_is_over(): the request goes back to the queue with what remains from
  /// `offset_bytes` on. If there is a slot, it is the next again and its client takes something, it has
  /// another turn, and the answer is true; else it waits. `taken_slots`: as of take(). REQUIRES: it runs and something
  /// remains. [O(log n)]
  bool yield(RequestKey key, std::uint64_t offset_bytes, Time now, std::size_t taken_slots = 0);
  /// A waiting request is out of the rule's sight until unpark(): its client cannot take anything now. No effect on
  /// others. [O(log n)]
  void park(RequestKey key);
  void unpark(RequestKey key, Time now);

  /// Everything of `session` leaves: its waiting requests are withdrawn, its running ones fail and free their slots.
  /// Returns the keys of all of them, ascending. [O(k log n) for k requests of that session]
  std::vector<RequestKey> remove_session(SessionKey session, Time now);

  /// From now on this policy decides. Requests that wait are re-ordered, those that run go on; none is lost.
  /// REQUIRES: as the constructor. [O(n log n)]
  void switch_to(Policy policy, Time now);

  [[nodiscard]] std::size_t waiting() const { return requests_.size() - running_; }
  [[nodiscard]] std::size_t running() const { return running_; }
  /// Whether requests of other sessions run, or wait for a slot that the rule may give them.
  [[nodiscard]] bool has_others(SessionKey session) const;
  /// Whether another request could start beside `running()` and `taken_slots` others.
  [[nodiscard]] bool has_slot(Time now, std::size_t taken_slots = 0) const;
  /// Whether a slot is free once all is written, or only once all of it is acknowledged: where the uplink is to be kept
  /// full, the round trip of the last byte belongs to the next transfer already.
  [[nodiscard]] bool frees_slot_when_written() const { return !policy_.slots; }
  [[nodiscard]] const Policy& policy() const { return policy_; }
  /// Bytes a second, as the policy says or as measured; 0: not known.
  [[nodiscard]] double uplink() const { return surroundings_.uplink; }
  [[nodiscard]] const Clients& clients() const { return clients_; }
  /// Waiting requests in the order in which they would go now, with the reason of each, at most `most`; those that are
  /// older than the policy's aging come first. [O(n log n)]
  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time now) const;
  /// nullptr if it is neither waiting nor running. Valid until the next change.
  [[nodiscard]] const Request* find(RequestKey key) const;
  [[nodiscard]] bool is_running(RequestKey key) const { return find_running(key) != nullptr; }
  /// Whether a request waits behind another of its own client, which runs: with slots=auto no client has two slots.
  [[nodiscard]] bool is_held(RequestKey key) const;
  /// How many requests of a session wait, and how many run.
  [[nodiscard]] std::pair<std::size_t, std::size_t> counts(SessionKey session) const;

 private:
  enum class State : std::uint8_t {
    waiting,
    held,    ///< of a client that is being served: one channel carries one transfer at a time
    parked,  ///< by the caller
    running,
  };
  struct Entry {
    Request request;
    const Client& client;
    State state = State::parked;
    Time turn_since{0};  ///< of a running one
    Time slot_since{0};  ///< its first turn in this slot began then
  };
  /// Oldest first.
  using Age = std::pair<Time, QueueOrder>;

  static Age age_of(const Request& request) { return {request.asked_at, QueueOrder::of(request)}; }
  /// The waiting request that goes next: an aged one, or the rule's.
  [[nodiscard]] std::optional<RequestKey> next(Time now) const;
  /// A request becomes one that waits, or is held.
  void join(Entry& entry, Time now);
  void leave(Entry& entry);
  [[nodiscard]] bool is_to_be_held(const Request& request) const;
  /// Holds what waits of a session that is being served, or lets go what is held of one that is not.
  void hold_or_release(SessionKey session, Time now);
  void start(Entry& entry, Time now);
  /// It has its slot since then, and is part of the load.
  void serve_since(Entry& entry, Time since);
  /// A running request gives its slot back, and the rule hears how.
  void stop(Entry& entry, Outcome outcome, Time now);
  bool finish(RequestKey key, Outcome outcome, Time now);
  /// nullptr if it is not known, or does not run.
  [[nodiscard]] Entry* entry_of(RequestKey key) const;
  [[nodiscard]] Entry* find_running(RequestKey key) const;
  [[nodiscard]] std::span<Entry* const> entries_of(SessionKey session) const;
  void forget(const Entry& entry);
  void client_changed(SessionKey session, Time now);
  [[nodiscard]] std::vector<const Request*> waiting_of(SessionKey session) const;
  /// With slots=auto: whether the clients together take so much of the uplink that it is full.
  [[nodiscard]] bool is_uplink_taken(Time now) const;
  /// Whether others would go on if a running request gave its slot back.
  [[nodiscard]] bool has_rivals(Time now) const;
  void note_uplink();

  Policy policy_;
  Clients clients_;
  Surroundings surroundings_{clients_, 0};
  UplinkMeter uplink_meter_;
  std::unique_ptr<Rule> rule_;
  KeyMap<std::unique_ptr<Entry>> requests_;
  std::size_t in_sight_ = 0;  ///< of the rule: how many are in State::waiting
  SortedBlocks<Age> ages_;    ///< of those, if the policy goes by them
  std::size_t running_ = 0;
  mutable Load load_{surroundings_};  ///< with slots=auto; is brought up to date when it is asked for
  /// The requests of a session, waiting or running: a handful each, because the network bounds what a session may open.
  KeyMap<std::vector<Entry*>> by_session_;
};

}  // namespace pmcd::scheduler
