// SPDX-License-Identifier: MIT
// A call from a coroutine of the network loop to a store thread and back. The loop goes on meanwhile.
#pragma once

#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "daemon/net/asio.h"
#include "daemon/store/store_thread.h"
//
#include <boost/asio/executor_work_guard.hpp>

namespace pmcd::net {

/// Runs `work(store)`, which returns a store::Result, on the store's thread and resumes the calling coroutine on
/// `executor` with what it returned. Errors beside those of `work`: database_failed (the thread's queue is full),
/// out_of_memory.
template <typename Work>
auto on_store(Executor executor, store::StoreThread& thread, Work work)
    -> awaitable<std::invoke_result_t<Work, store::MeshStore&>> {
  using Answer = std::invoke_result_t<Work, store::MeshStore&>;
  auto initiate = [&thread, executor, &work](auto handler) {
    // The queue's jobs are copyable functions, the handler can only be moved: hence the shared pointers.
    auto waiting = std::make_shared<decltype(handler)>(std::move(handler));
    auto guard = std::make_shared<asio::executor_work_guard<Executor>>(executor);
    const auto resume = [executor, waiting, guard](Answer answer) {
      asio::post(executor, [waiting, answer = std::move(answer)]() mutable { (*waiting)(std::move(answer)); });
      guard->reset();
    };
    const auto guarded = [](Work& job, store::MeshStore& store) -> Answer {
      try {
        return job(store);
      } catch (const std::bad_alloc&) {
        return store::Error{store::ErrorCode::out_of_memory, "out of memory"};
      }
    };
    const bool posted = thread.post(
        [work = std::move(work), guarded, resume](store::MeshStore& store) mutable { resume(guarded(work, store)); });
    if (!posted) resume(store::Error{store::ErrorCode::database_failed, "too many requests wait for the database"});
  };
  co_return co_await asio::async_initiate<const asio::use_awaitable_t<Executor>&, void(Answer)>(std::move(initiate),
                                                                                                kUseAwaitable);
}

}  // namespace pmcd::net
