// SPDX-License-Identifier: MIT
// A store thread that a test holds up, and how much waits for it meanwhile.
#pragma once

#include <atomic>
#include <cstddef>
#include <future>
#include <thread>

#include "daemon/store/store_thread.h"

namespace pmcd::test {

/// Keeps a store thread busy until the object goes.
class Busy {
 public:
  explicit Busy(store::StoreThread& thread) : thread_(thread) {
    std::promise<void> begun;
    thread.post([&begun, release = release_.get_future().share()](store::MeshStore&) {
      begun.set_value();
      release.wait();
    });
    begun.get_future().wait();
  }
  Busy(const Busy&) = delete;
  Busy& operator=(const Busy&) = delete;
  /// Returns when what fill_and_count() put in is out again.
  ~Busy() {
    release_.set_value();
    while (ran_ < filled_) std::this_thread::yield();
  }

  /// How many jobs wait: as many as the queue takes, less those that go in now and do nothing. Afterwards it is full
  /// until the thread goes on: nobody may need it before the object has gone. Once only.
  std::size_t fill_and_count() {
    while (thread_.post([this](store::MeshStore&) { ++ran_; })) ++filled_;
    return store::StoreThread::kMaxQueue - filled_;
  }

 private:
  store::StoreThread& thread_;
  std::promise<void> release_;
  std::size_t filled_ = 0;
  std::atomic<std::size_t> ran_ = 0;
};

}  // namespace pmcd::test
