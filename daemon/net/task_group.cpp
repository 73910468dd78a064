// SPDX-License-Identifier: MIT
// Spawning with a count and a handler that looks at the exception.
#include "daemon/net/task_group.h"

#include <spdlog/spdlog.h>

#include <exception>

namespace pmcd::net {
namespace {

/// co_spawn() of Boost 1.74 starts a task later, that of later ones at once when it can.
awaitable<void> later(Executor executor, awaitable<void> task) {
  co_await asio::post(executor, kUseAwaitable);
  co_await std::move(task);
}

}  // namespace

void TaskGroup::spawn(const char* name, awaitable<void> task) {
  asio::co_spawn(executor_, later(executor_, std::move(task)), [this, name](const std::exception_ptr& escaped) {
    --running_;
    if (running_ == 0) idle_.notify();
    if (!escaped) return;
    try {
      std::rethrow_exception(escaped);
    } catch (const std::exception& error) {
      spdlog::error("{}: ended by an exception: {}", name, error.what());
    } catch (...) {
      spdlog::error("{}: ended by an unknown exception", name);
    }
  });
  ++running_;
}

awaitable<bool> TaskGroup::wait_idle(Duration limit) {
  const Clock::time_point deadline = Clock::now() + limit;
  while (running_ > 0 && Clock::now() < deadline) co_await idle_.wait_until(deadline);
  co_return running_ == 0;
}

}  // namespace pmcd::net
