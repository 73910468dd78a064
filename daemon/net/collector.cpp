// SPDX-License-Identifier: MIT
// One task that sleeps until the next mesh is due, and deletes in steps so that ingests can go in between.
#include "daemon/net/collector.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/net/on_store.h"

namespace pmcd::net {
namespace {

/// After a failure, for instance because another process keeps the database locked.
constexpr Duration kRetry = std::chrono::seconds(60);

}  // namespace

void Collector::retire(store::MeshId mesh, bool held) {
  const Clock::time_point now = Clock::now();
  retired_[mesh] = {now + grace_, held ? now + grace_ : now, false};
  start();
}

void Collector::held(store::MeshId mesh) {
  const auto it = retired_.find(mesh);
  if (it != retired_.end() && !it->second.gone) it->second.due = it->second.until;
}

void Collector::released(store::MeshId mesh) {
  const auto it = retired_.find(mesh);
  if (it == retired_.end() || it->second.gone) return;
  it->second.due = Clock::now();
  changed_.notify();
}

awaitable<void> Collector::collect_leftovers() {
  auto work = [](store::MeshStore& store) { return store.retired(); };
  const auto left = co_await on_store(tasks_.executor(), writer_, std::move(work));
  if (!left) {
    spdlog::error("meshes that were replaced or removed before the start: {}: {}", store::error_name(left.error().code),
                  left.error().detail);
    co_return;
  }
  if (left.value().empty()) co_return;
  spdlog::info("{} meshes were replaced or removed before the start and are deleted now", left.value().size());
  for (const store::MeshId mesh : left.value()) retire(mesh, false);
}

void Collector::stop() {
  stopping_ = true;
  changed_.notify();
}

bool Collector::is_gone(store::MeshId mesh) const {
  const auto it = retired_.find(mesh);
  return it != retired_.end() && it->second.gone;
}

void Collector::start() {
  if (running_) {
    changed_.notify();
    return;
  }
  running_ = true;
  tasks_.spawn("collector", run());
}

awaitable<void> Collector::run() {
  struct Ended {  // also by an exception: the next retired mesh then starts another task
    bool& running;
    ~Ended() { running = false; }
  } const ended{running_};
  while (!stopping_ && !retired_.empty()) {
    const auto next = std::min_element(retired_.begin(), retired_.end(),
                                       [](const auto& a, const auto& b) { return a.second.due < b.second.due; });
    if (next->second.due <= Clock::now()) {
      co_await collect(next->first);
    } else {
      co_await changed_.wait_until(next->second.due);
    }
  }
}

awaitable<void> Collector::collect(store::MeshId mesh) {
  Retired& retired = retired_.at(mesh);
  if (!std::exchange(retired.gone, true)) on_gone_(mesh);
  while (!stopping_) {
    auto work = [mesh](store::MeshStore& store) { return store.collect(mesh); };
    const auto step = co_await on_store(tasks_.executor(), writer_, std::move(work));
    if (!step) {
      spdlog::error("mesh {}, replaced or removed, cannot be deleted yet: {}: {}", mesh,
                    store::error_name(step.error().code), step.error().detail);
      // Damage does not go away by itself, and one line in the log is enough.
      const bool damaged = step.error().code == store::ErrorCode::database_corrupt;
      retired.due = damaged ? Clock::time_point::max() : Clock::now() + kRetry;
      co_return;
    }
    if (step.value() == store::Collected::part) continue;
    spdlog::info("mesh {}, replaced or removed, is deleted", mesh);
    retired_.erase(mesh);
    co_return;
  }
}

}  // namespace pmcd::net
