// SPDX-License-Identifier: MIT
// The loop of the store's thread.
#include "daemon/store/store_thread.h"

#include <future>
#include <utility>

namespace pmcd::store {

Result<std::unique_ptr<StoreThread>> StoreThread::start(const std::string& path) {
  std::unique_ptr<StoreThread> self(new StoreThread);
  std::promise<Status> opened;
  auto status = opened.get_future();
  self->thread_ = std::thread([path, opened = std::move(opened), thread = self.get()]() mutable {
    auto store = MeshStore::open(path);
    if (!store) {
      opened.set_value(store.error());
      return;
    }
    const std::unique_ptr<MeshStore> owned = std::move(store).value();
    opened.set_value(Done{});
    thread->run(*owned);
  });
  if (const Status result = status.get(); !result.ok()) return result.error();
  return self;
}

StoreThread::~StoreThread() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

bool StoreThread::post(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= kMaxQueue) return false;
    queue_.push_back(std::move(job));
  }
  changed_.notify_one();
  return true;
}

void StoreThread::run(MeshStore& store) {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (queue_.empty()) return;
    Job job = std::move(queue_.front());
    queue_.pop_front();
    lock.unlock();
    job(store);
    job = nullptr;  // what it holds goes before the lock is taken again
    lock.lock();
  }
}

}  // namespace pmcd::store
