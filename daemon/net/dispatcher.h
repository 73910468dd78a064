// SPDX-License-Identifier: MIT
// Between sessions and scheduler: requests go in, and when the scheduler gives one a slot, its transfer runs here,
// chunk by chunk, until the client's kernel has acknowledged its last byte. It knows no rule; the scheduler knows no
// socket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/limits.h"
#include "daemon/net/mesh_source.h"
#include "daemon/net/pace.h"
#include "daemon/net/task_group.h"
#include "daemon/net/transfer.h"
#include "daemon/scheduler/scheduler.h"

namespace pmcd::net {

class Dispatcher {
 public:
  using Key = scheduler::RequestKey;

  /// REQUIRES: `meshes`, `tasks` and `limits` outlive it.
  Dispatcher(scheduler::Scheduler scheduler, MeshSource& meshes, TaskGroup& tasks, const Limits& limits);
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
  /// No waiting request gets a slot any more; running transfers go on.
  void drain();
  /// Returns when nothing is running or `limit` is over: whether nothing is.
  awaitable<bool> wait_idle(Duration limit);

  [[nodiscard]] std::size_t waiting() const { return scheduler_.waiting(); }
  [[nodiscard]] std::size_t running() const { return scheduler_.running(); }
  [[nodiscard]] std::size_t slots() const { return scheduler_.slots(); }
  [[nodiscard]] std::string_view rule() const { return scheduler_.rule_name(); }

 private:
  enum class Stage : std::uint8_t {
    starting,
    reading,  ///< its packet comes from the store
    sending,  ///< chunks go into the channel as it has room
    sent,     ///< its end is queued; the slot is held until that is acknowledged
  };
  struct Running {
    Transfer transfer;
    Stage stage = Stage::starting;
    bool cancelled = false;
    std::uint64_t next = 0;          ///< offset in the packet of the next byte to send
    std::uint64_t end_position = 0;  ///< of the channel's stream, once sent
    Clock::time_point poll_at;       ///< when to look next whether it is acknowledged
    Duration pause{0};
  };
  /// What is remembered of a session that has had a turn.
  struct Turn {
    std::vector<Key> running;
    Pace pace;
  };

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
  /// The end of the transfer is queued behind its last chunk.
  void end_sending(Key key);
  /// Frees the slot if the end is acknowledged; else looks again later.
  void settle(Key key, std::uint64_t acknowledged, Clock::time_point now);
  /// The transfer is over and its slot free.
  void release(Key key);
  /// Runs while anything is running: asks the kernel what was acknowledged, and closes sessions that do not take their
  /// data.
  awaitable<void> watch();
  /// Somebody waits and all slots are taken: asks sooner what was acknowledged.
  void hurry();
  /// Asks for all that are due; when the next is.
  Clock::time_point poll(Clock::time_point now);
  void judge(Clock::time_point now);

  scheduler::Scheduler scheduler_;
  MeshSource& meshes_;
  TaskGroup& tasks_;
  const Limits& limits_;
  std::unordered_map<Key, Transfer> waiting_;
  std::unordered_map<Key, Running> running_;
  std::unordered_map<scheduler::SessionKey, Turn> turns_;
  std::unordered_set<Key> abandoned_;  ///< transfers that are gone while the store reads for them
  Key next_key_ = 1;
  bool draining_ = false;
  bool pump_is_due_ = false;
  bool watching_ = false;
  Clock::time_point watch_wakes_at_;
  Condition idle_;
  Condition watch_;  ///< ends the pause of the watch early
};

}  // namespace pmcd::net
