// SPDX-License-Identifier: MIT
// A thread that owns one MeshStore and works through a bounded queue, so that nobody else ever waits for SQLite. The
// daemon runs two: one that reads packets for clients and one that writes, and a long commit does not hold up a read.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "daemon/store/mesh_store.h"
#include "daemon/store/result.h"

namespace pmcd::store {

class StoreThread {
 public:
  /// Runs on the store's thread, must not throw, and hands its result back itself (for instance by posting it).
  using Job = std::function<void(MeshStore&)>;

  static constexpr std::size_t kMaxQueue = 65'536;

  /// Starts the thread and opens the database on it; returns when that is done. Errors: those of MeshStore::open.
  static Result<std::unique_ptr<StoreThread>> start(const std::string& path);
  /// Works off what is queued, then ends the thread.
  ~StoreThread();
  StoreThread(const StoreThread&) = delete;
  StoreThread& operator=(const StoreThread&) = delete;

  /// Queues a job; jobs run in the order in which they came. False, and `job` will not run, when kMaxQueue wait.
  /// Any thread.
  bool post(Job job);

 private:
  StoreThread() = default;
  void run(MeshStore& store);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> queue_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace pmcd::store
