// SPDX-License-Identifier: MIT
// Retired meshes from the moment in which their name is free to the deletion of their last packet: a mesh is collected
// when nobody holds it any more, or when its grace time is over. It holds no mesh and reads no packet. One thread only.
#pragma once

#include <functional>
#include <map>

#include "daemon/net/asio.h"
#include "daemon/net/task_group.h"
#include "daemon/store/store_thread.h"

namespace pmcd::net {

class Collector {
 public:
  /// `on_gone` is told, once for each mesh, that it may not be read from now on. REQUIRES: `tasks` and `writer` outlive
  /// the collector, and the collector its task (stop() and TaskGroup::wait_idle see to that).
  Collector(TaskGroup& tasks, store::StoreThread& writer, Duration grace, std::function<void(store::MeshId)> on_gone)
      : tasks_(tasks), writer_(writer), grace_(grace), on_gone_(std::move(on_gone)), changed_(tasks.executor()) {}
  Collector(const Collector&) = delete;
  Collector& operator=(const Collector&) = delete;

  /// The mesh was retired in the database. `held`: somebody reads it.
  void retire(store::MeshId mesh, bool held);
  /// Somebody holds the mesh, again or for the first time. No effect on one that is not retired, or is gone.
  void held(store::MeshId mesh);
  /// Nobody holds the mesh any more. No effect on one that is not retired.
  void released(store::MeshId mesh);
  /// Collects what an earlier run of the daemon has left; returns when it is known what that is. REQUIRES: called
  /// before the first retire().
  awaitable<void> collect_leftovers();
  /// Collects nothing more, except for the step that is under way. The next start does the rest.
  void stop();

  [[nodiscard]] bool is_retired(store::MeshId mesh) const { return retired_.contains(mesh); }
  /// May not be read any more.
  [[nodiscard]] bool is_gone(store::MeshId mesh) const;
  [[nodiscard]] Duration grace() const { return grace_; }

 private:
  struct Retired {
    Clock::time_point until;  ///< end of the grace time
    Clock::time_point due;    ///< when it is to be collected
    bool gone = false;
  };

  void start();
  /// Runs while there is something to collect, now or later.
  awaitable<void> run();
  awaitable<void> collect(store::MeshId mesh);

  TaskGroup& tasks_;
  store::StoreThread& writer_;
  const Duration grace_;
  const std::function<void(store::MeshId)> on_gone_;
  std::map<store::MeshId, Retired> retired_;
  bool running_ = false;
  bool stopping_ = false;
  Condition changed_;
};

}  // namespace pmcd::net
