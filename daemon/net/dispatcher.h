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

#include "daemon/net/asio.h"
#include "daemon/net/catalog.h"
#include "daemon/net/limits.h"
#include "daemon/net/task_group.h"
#include "daemon/scheduler/scheduler.h"

namespace pmcd::net {

class Session;

/// A request as the network sees it: for whom and what is sent.
struct Transfer {
  std::shared_ptr<Session> session;
  std::uint32_t id = 0;  ///< the client's
  std::uint32_t handle = 0;
  std::uint32_t packet = 0;
  store::MeshId mesh = 0;
  SharedBytes bytes;  ///< what is sent; null: the packet is read when the transfer starts
};

class Dispatcher {
 public:
  Dispatcher(scheduler::Scheduler scheduler, Catalog& catalog, TaskGroup& tasks, const Limits& limits);
  Dispatcher(const Dispatcher&) = delete;
  Dispatcher& operator=(const Dispatcher&) = delete;

  /// `transfer` waits for a slot. `size_bytes`: what it will send. `asked_at`: when the client's request came.
  void enqueue(Transfer transfer, std::uint64_t size_bytes, Clock::time_point asked_at);
  /// The session is closed: its requests leave the queue and its slots are free.
  void session_gone(std::uint64_t session_key);
  /// No waiting request gets a slot any more; running transfers go on.
  void drain() {
    draining_ = true;
    watch_.notify();
  }
  /// Returns when nothing is running or `limit` is over: whether nothing is.
  awaitable<bool> wait_idle(Duration limit);

  [[nodiscard]] std::size_t waiting() const { return scheduler_.waiting(); }
  [[nodiscard]] std::size_t running() const { return scheduler_.running(); }
  [[nodiscard]] std::size_t slots() const { return scheduler_.slots(); }
  [[nodiscard]] std::string_view rule() const { return scheduler_.rule_name(); }

 private:
  /// What the stall watch remembers of a running transfer.
  struct Running {
    std::shared_ptr<Session> session;
    std::uint64_t acknowledged = 0;
    Clock::time_point progress_at;
  };

  void pump();
  /// What follows when a slot became free.
  void slots_changed();
  /// Holds a slot until the transfer has ended, well or not.
  awaitable<void> run(scheduler::RequestKey key, Transfer transfer);
  awaitable<void> carry_out(scheduler::RequestKey key, const Transfer& transfer);
  /// Sends all chunks and the end of the transfer; false if the session closed meanwhile.
  awaitable<bool> send(const Transfer& transfer, const SharedBytes& bytes);
  /// Closes sessions whose transfer stands still. Runs while anything is running.
  awaitable<void> watch();

  scheduler::Scheduler scheduler_;
  Catalog& catalog_;
  TaskGroup& tasks_;
  const Limits& limits_;
  std::map<scheduler::RequestKey, Transfer> waiting_;
  std::map<scheduler::RequestKey, Running> running_;
  scheduler::RequestKey next_key_ = 1;
  bool draining_ = false;
  bool watching_ = false;
  Condition idle_;
  Condition watch_;  ///< ends the pause of the stall watch early, when the daemon ends
};

}  // namespace pmcd::net
