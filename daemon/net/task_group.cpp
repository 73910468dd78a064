// SPDX-License-Identifier: MIT
// Spawning with a count and a handler that looks at the exception.
#include "daemon/net/task_group.h"

#include <spdlog/spdlog.h>

#include <exception>

namespace pmcd::net {

void TaskGroup::spawn(const char* name, awaitable<void> task) {
  ++running_;
  asio::co_spawn(executor_, std::move(task), [this, name](const std::exception_ptr& escaped) {
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
}

awaitable<bool> TaskGroup::wait_idle(Duration limit) {
  const Clock::time_point deadline = Clock::now() + limit;
  while (running_ > 0 && Clock::now() < deadline) co_await idle_.wait_until(deadline);
  co_return running_ == 0;
}

}  // namespace pmcd::net
