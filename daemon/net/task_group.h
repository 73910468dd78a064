// SPDX-License-Identifier: MIT
// Every coroutine of the network room belongs to a task group: none runs unseen, none that throws goes unnoticed, and
// the end of the daemon can wait for all of them. One thread only.
#pragma once

#include <cstddef>
#include <string>

#include "daemon/net/asio.h"

namespace pmcd::net {

class TaskGroup {
 public:
  explicit TaskGroup(Executor executor) : executor_(std::move(executor)), idle_(executor_) {}
  TaskGroup(const TaskGroup&) = delete;
  TaskGroup& operator=(const TaskGroup&) = delete;

  /// Starts `task`, later and not within this call; an exception that leaves it is logged with `name` and ends that
  /// task only. REQUIRES: the group outlives the task.
  void spawn(const char* name, awaitable<void> task);

  [[nodiscard]] std::size_t running() const { return running_; }
  /// Returns when no task is running or `limit` is over: whether none is. Not to be called by a task of this group.
  awaitable<bool> wait_idle(Duration limit);

  [[nodiscard]] const Executor& executor() const { return executor_; }

 private:
  Executor executor_;
  std::size_t running_ = 0;
  Condition idle_;
};

}  // namespace pmcd::net
