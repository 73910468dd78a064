// SPDX-License-Identifier: MIT
// Watches request channels that owe their clients answers, and drops a session whose client takes none of them: what
// the dispatcher does for packets on data channels. A session with nothing under way is not looked at.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/limits.h"
#include "daemon/net/task_group.h"

namespace pmcd::net {

class Session;

class AnswerWatch {
 public:
  /// REQUIRES: both outlive this object, which outlives the tasks.
  AnswerWatch(TaskGroup& tasks, const Limits& limits) : tasks_(tasks), limits_(limits), wake_(tasks.executor()) {}
  AnswerWatch(const AnswerWatch&) = delete;
  AnswerWatch& operator=(const AnswerWatch&) = delete;

  /// The session has queued an answer; it is looked at until Session::owes_answers() says no. To be called once until
  /// then.
  void add(std::weak_ptr<Session> session);
  /// A session that is watched was closed.
  void closed();

 private:
  awaitable<void> watch();
  void look(Clock::time_point now);

  TaskGroup& tasks_;
  const Limits& limits_;
  std::vector<std::weak_ptr<Session>> watched_;
  std::size_t open_ = 0;  ///< of them, not closed
  bool watching_ = false;
  Condition wake_;
};

}  // namespace pmcd::net
