// SPDX-License-Identifier: MIT
// Carries out turns over sockets: holds what requests send, reads it from the store, queues its chunks on their data
// channels, and tells sessions how their requests end. It knows no rule, and decides neither who is next nor when a
// turn is over: that is daemon/turns and the scheduler.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "daemon/net/asio.h"
#include "daemon/net/limits.h"
#include "daemon/net/mesh_source.h"
#include "daemon/net/queue_view.h"
#include "daemon/net/task_group.h"
#include "daemon/net/transfer.h"
#include "daemon/turns/turns.h"

namespace pmcd::net {

class Dispatcher : private turns::Host {
 public:
  using Key = scheduler::RequestKey;

  /// REQUIRES: `meshes`, `tasks` and `limits` outlive it.
  Dispatcher(scheduler::Policy policy, MeshSource& meshes, TaskGroup& tasks, const Limits& limits);

  /// `transfer` waits for a slot; nothing of it happens before this has returned. `size_bytes`: of the whole packet.
  /// `asked_at`: when the client's request came. The key is good for cancel().
  Key enqueue(Transfer transfer, std::uint64_t size_bytes, Clock::time_point asked_at);
  /// Ends a transfer whose end is not queued yet: its session hears transfer_cancelled before this returns, and what
  /// was sent keeps the slot until it is acknowledged. No effect on others.
  void cancel(Key key) { turns_.cancel(key); }
  /// The session's data channel has written something: its transfers may go on.
  void progress(scheduler::SessionKey session) { turns_.progress(session); }
  /// The session's client asks for more.
  void heard(scheduler::SessionKey session) { turns_.heard(session); }
  /// The session is closed: its requests leave the queue and its slots are free.
  void session_gone(scheduler::SessionKey session);
  /// As of turns.
  void switch_to(scheduler::Policy policy) { turns_.switch_to(std::move(policy)); }
  /// A session's share under rules that have shares, 1 at first. REQUIRES: more than 0.
  void set_weight(scheduler::SessionKey session, double weight) { turns_.set_weight(session, weight); }
  /// No waiting request gets a slot any more; running transfers go on.
  void drain();
  /// Returns when nothing is running or `limit` is over: whether nothing is.
  awaitable<bool> wait_idle(Duration limit);

  [[nodiscard]] std::size_t waiting() const { return scheduler().waiting(); }
  [[nodiscard]] std::size_t running() const { return scheduler().running(); }
  [[nodiscard]] const scheduler::Policy& policy() const { return scheduler().policy(); }
  /// Bytes a second; 0: not known.
  [[nodiscard]] double uplink() const { return scheduler().uplink(); }
  /// Turns that a quantum has ended.
  [[nodiscard]] std::uint64_t interruptions() const { return turns_.interruptions(); }
  /// What runs and what waits, at most `most` of them: see QueueView.
  [[nodiscard]] QueueView queue(std::size_t most) const;
  /// What is known of a session as a client.
  [[nodiscard]] ClientView client(scheduler::SessionKey session) const;

 private:
  [[nodiscard]] turns::Time now() const override;
  std::size_t other_slots() override;
  void pump_soon() override;
  void poll_by(turns::Time when) override;
  std::shared_ptr<turns::Stream> stream_of(Key key) override;
  std::optional<turns::Content> fetch(Key key) override;
  void send(Key key, std::uint64_t offset, std::size_t size) override;
  std::size_t take_back(Key key) override;
  void end(Key key, bool is_cancelled) override;
  void interrupted(Key key) override;
  void released(Key key) override;
  void broken(Key key, const std::exception& error) override;
  void drop(scheduler::SessionKey session, turns::Pace::Verdict verdict) override;

  [[nodiscard]] const scheduler::Scheduler& scheduler() const { return turns_.scheduler(); }
  /// Sets the task going that waits for what the store answers.
  void begin_reading(Key key, const char* name, awaitable<store::Result<SharedBytes>> answer);
  awaitable<void> read(Key key, awaitable<store::Result<SharedBytes>> answer);
  /// Once the store has answered: the transfer goes on with that, or fails, if it is still there.
  awaitable<void> serve_from_store(Key key, awaitable<store::Result<SharedBytes>> answer);
  /// `transfer` leaves. What the store still answers finds nobody, but has to be waited for: see other_slots().
  void forget(Key key);
  /// An interrupted transfer keeps its packet if no cache takes it, so that the next turn need not read it again: as
  /// far as there is room, as much as the cache's. What holds the room; null if it is not to be kept.
  std::shared_ptr<const void> room_for_packet(const Transfer& transfer);
  /// Runs while anything is running or owed.
  awaitable<void> poll_turns();
  [[nodiscard]] RequestView view(Key key) const;

  /// Before the transfers, whose packets count themselves off.
  std::size_t kept_bytes_ = 0;
  MeshSource& meshes_;
  TaskGroup& tasks_;
  const Limits& limits_;
  turns::Turns turns_;
  std::unordered_map<Key, Transfer> transfers_;  ///< that wait or run
  std::unordered_map<scheduler::SessionKey, std::weak_ptr<Session>> served_;
  std::unordered_set<Key> abandoned_;  ///< transfers that are gone while the store reads for them
  Key next_key_ = 1;
  bool draining_ = false;
  bool pump_is_due_ = false;
  bool polls_ = false;
  Condition idle_;
  Condition poll_;  ///< ends the pause between two polls early
};

}  // namespace pmcd::net
