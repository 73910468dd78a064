// SPDX-License-Identifier: MIT
// Between sessions and scheduler: requests go in, and when the scheduler gives one a slot, its transfer runs here,
// chunk by chunk, until its turn is over or the client's kernel has acknowledged its last byte. What the kernel says of
// each client's channel goes to the scheduler. It knows no rule; the scheduler knows no socket. Turns are in
// dispatcher.cpp, what is seen of the clients' lines in dispatcher_watch.cpp.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/data_line.h"
#include "daemon/net/limits.h"
#include "daemon/net/mesh_source.h"
#include "daemon/net/queue_view.h"
#include "daemon/net/task_group.h"
#include "daemon/net/transfer.h"
#include "daemon/scheduler/scheduler.h"

namespace pmcd::net {

class Dispatcher {
 public:
  using Key = scheduler::RequestKey;

  /// REQUIRES: `meshes`, `tasks` and `limits` outlive it.
  Dispatcher(scheduler::Policy policy, MeshSource& meshes, TaskGroup& tasks, const Limits& limits);
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  /// `transfer` waits for a slot; nothing of it happens before this has returned. `size_bytes`: of the whole packet.
  /// `asked_at`: when the client's request came. The key is good for cancel().
  Key enqueue(Transfer transfer, std::uint64_t size_bytes, Clock::time_point asked_at);
  /// Ends a transfer whose end is not queued yet: its session hears transfer_cancelled before this returns, and what
  /// was sent keeps the slot until it is acknowledged. No effect on others.
  void cancel(Key key);
  /// The session's data channel has written something: its transfers may go on.
  void progress(scheduler::SessionKey session);
  /// The session's client asks for more, so it has mostly acknowledged what it had: its slots may be free.
  void heard(scheduler::SessionKey session);
  /// The session is closed: its requests leave the queue and its slots are free.
  void session_gone(scheduler::SessionKey session);
  /// From now on this policy decides: waiting requests are put in its order, running transfers go on until it
  /// interrupts them. REQUIRES: as the scheduler's.
  void switch_to(scheduler::Policy policy);
  /// A session's share under rules that have shares, 1 at first. REQUIRES: more than 0.
  void set_weight(scheduler::SessionKey session, double weight);
  /// No waiting request gets a slot any more; running transfers go on.
  void drain();
  /// Returns when nothing is running or `limit` is over: whether nothing is.
  awaitable<bool> wait_idle(Duration limit);

  [[nodiscard]] std::size_t waiting() const { return scheduler_.waiting(); }
  [[nodiscard]] std::size_t running() const { return scheduler_.running(); }
  [[nodiscard]] const scheduler::Policy& policy() const { return scheduler_.policy(); }
  /// Bytes a second; 0: not known.
  [[nodiscard]] double uplink() const { return scheduler_.uplink(); }
  /// Turns that a quantum has ended.
  [[nodiscard]] std::uint64_t interruptions() const { return interruptions_; }
  /// What runs and what waits, at most `most` of them: see QueueView.
  [[nodiscard]] QueueView queue(std::size_t most) const;
  /// What is known of a session as a client.
  [[nodiscard]] ClientView client(scheduler::SessionKey session) const;

 private:
  enum class Stage : std::uint8_t {
    starting,
    reading,  ///< its packet comes from the store
    sending,  ///< chunks go into the channel as it has room
    stopped,  ///< interrupted without a slot; waits again once the channel has taken what was queued
    sent,     ///< its end is queued; the slot is held until that is acknowledged
  };
  struct Running {
    Transfer transfer;
    Stage stage = Stage::starting;
    bool cancelled = false;
    bool begun = false;              ///< a chunk of this turn is queued
    bool hurried = false;            ///< it was looked at sooner because others wait
    std::uint64_t next = 0;          ///< offset in the packet of the next byte to send
    std::uint64_t end_position = 0;  ///< of the channel's stream, once sent
  };
  /// A session that has had a turn.
  struct Turn {
    std::weak_ptr<Session> session;
    std::shared_ptr<Channel> channel;
    DataLine line;
    std::vector<Key> running;
  };
  using Turns = std::unordered_map<scheduler::SessionKey, Turn>;

  /// Gives free slots to waiting requests, at the end of this turn of the loop.
  void pump_soon();
  void pump();
  void start(Key key);
  /// Sets the task going that waits for what the store answers and goes on with it.
  void begin_reading(Key key, const char* name, awaitable<store::Result<SharedBytes>> answer);
  awaitable<void> read(Key key, awaitable<store::Result<SharedBytes>> answer);
  /// What the store still answers finds nobody, but has to be waited for: see pump().
  void abandon(const Running& running, Key key);
  /// Runs a step of a transfer; an exception ends its session and nothing else.
  template <typename Step>
  void guarded(Key key, Step step);
  void feed(Key key);
  /// Where several share the uplink: whether enough is under way to a client of whom little is known.
  bool is_held_back(scheduler::SessionKey session, Turn& turn);
  /// At a chunk boundary: whether the transfer may go on. If not, it waits again, or will once its channel is empty.
  bool may_go_on(Key key);
  /// An interrupted transfer keeps its packet if no cache takes it, so that the next turn need not read it again: as
  /// far as there is room, as much as the cache's. What holds the room; null if it is not to be kept.
  std::shared_ptr<const void> room_for_packet(const Transfer& transfer);
  /// A stopped transfer joins the queue.
  void wait_again(Key key);
  /// The end of the transfer is queued behind its last chunk.
  void end_sending(Key key);
  /// The transfer is over and its slot free.
  void release(Key key);
  Turn& turn_of(const Transfer& transfer);
  /// Asks what the session's client has acknowledged, tells the scheduler, and ends or goes on with its transfers.
  void look(scheduler::SessionKey session, Turn& turn, Clock::time_point now);
  /// Those of the session's transfers that are through, or may wait again, as of this look.
  void settle(scheduler::SessionKey session);
  [[nodiscard]] bool is_through(Key key, const Running& running, Turn& turn) const;
  /// The session is looked at no later than then.
  void look_by(scheduler::SessionKey session, Turn& turn, Clock::time_point when);
  /// Runs while anything is running or owed: asks the kernel what was acknowledged, and closes sessions that do not
  /// take their data.
  awaitable<void> watch();
  /// Somebody waits and all slots are taken: asks sooner what was acknowledged.
  void hurry();
  /// Asks for all that are due; when the next is.
  Clock::time_point poll(Clock::time_point now);
  void judge(Clock::time_point now);
  [[nodiscard]] RequestView view(const Transfer& transfer, const scheduler::Request& request) const;

  static constexpr Duration kFirstPoll = std::chrono::milliseconds(1);
  static constexpr Duration kLongestPoll = std::chrono::milliseconds(20);

  /// Before what waits and runs, whose packets count themselves off.
  std::size_t kept_bytes_ = 0;
  scheduler::Scheduler scheduler_;
  MeshSource& meshes_;
  TaskGroup& tasks_;
  const Limits& limits_;
  std::unordered_map<Key, Transfer> waiting_;
  std::unordered_map<Key, Running> running_;
  Turns turns_;
  std::unordered_set<scheduler::SessionKey> watched_;  ///< sessions with something running or not acknowledged
  std::unordered_set<Key> abandoned_;                  ///< transfers that are gone while the store reads for them
  Key next_key_ = 1;
  std::uint64_t interruptions_ = 0;
  bool draining_ = false;
  bool pump_is_due_ = false;
  bool watching_ = false;
  Clock::time_point watch_wakes_at_;
  Clock::time_point uplink_at_;  ///< when to look next whether the uplink has room
  Condition idle_;
  Condition watch_;  ///< ends the pause of the watch early
};

}  // namespace pmcd::net
