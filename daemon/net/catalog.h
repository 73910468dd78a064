// SPDX-License-Identifier: MIT
// The mesh database as coroutines see it: every call goes to a store thread and comes back, so the network loop never
// waits for SQLite. What many sessions ask for (the mesh list, a mesh's directory, hot packets) is held once and
// shared, and what many ask for at the same time is read once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "daemon/net/asio.h"
#include "daemon/net/collector.h"
#include "daemon/net/held_meshes.h"
#include "daemon/net/mesh_index.h"
#include "daemon/net/mesh_source.h"
#include "daemon/net/on_store.h"
#include "daemon/net/packet_cache.h"
#include "daemon/net/task_group.h"
#include "daemon/store/mesh_store.h"
#include "daemon/store/store_thread.h"
#include "daemon/store/upload.h"

namespace pmcd::net {

struct CatalogOptions {
  store::UploadLimits uploads;
  std::size_t cache_bytes = std::size_t{64} << 20;  ///< of hot packets in memory; 0: none are kept
  Duration grace = std::chrono::seconds(600);       ///< of a mesh that was replaced or removed while somebody holds it
};

class Catalog final : public MeshSource {
 public:
  /// Its coroutines run on the executor of `tasks`. REQUIRES: `tasks` and the threads outlive the catalog, and the
  /// catalog every coroutine in it.
  Catalog(TaskGroup& tasks, store::StoreThread& reader, store::StoreThread& writer, const CatalogOptions& options);

  /// A page of the mesh list as it travels, see MeshIndex::page.
  awaitable<store::Result<SharedBytes>> mesh_list(std::string filter, std::string after, std::uint32_t most) override;
  /// By the length of the list when it was made last; before that, of a list of one mesh.
  [[nodiscard]] std::uint64_t mesh_list_bytes(std::uint32_t most) const override { return list_size_.page_bytes(most); }
  /// The mesh of that name. Errors: those of MeshStore::find.
  awaitable<store::Result<SharedMesh>> find(std::string name) override;
  /// A mesh of that content, live or still in its grace time. Errors: those of MeshStore::find.
  awaitable<store::Result<SharedMesh>> find_generation(std::uint64_t generation) override;
  /// From the cache or the database. Errors: those of MeshStore::read_packet; unknown_mesh from the moment in which
  /// nobody holds a retired mesh any more or its grace time is over.
  awaitable<store::Result<SharedBytes>> read_packet(store::MeshId mesh, std::uint32_t packet) override;
  /// From the cache; null if it is not there, and then read_packet is to be asked.
  SharedBytes cached_packet(store::MeshId mesh, std::uint32_t packet) override;

  /// What `make(list)` makes of the list of all meshes and of those that are damaged, on the reader's thread: nothing
  /// that `make` touches may be touched elsewhere. Errors: those of MeshStore::list.
  template <typename Make, typename Made = std::invoke_result_t<Make, const store::MeshList&>>
  awaitable<store::Result<Made>> summarize(Make make) {
    auto work = [make = std::move(make)](store::MeshStore& store) -> store::Result<Made> {
      const auto list = store.list();
      if (!list) return list.error();
      return make(list.value());
    };
    co_return co_await on_store(tasks_.executor(), reader_, std::move(work));
  }
  /// Retires the mesh of that name. Error: unknown_mesh.
  awaitable<store::Result<store::Removed>> remove(std::string name);

  /// An ingest in steps, see Upload. The shared pointer keeps it alive while a step runs on the store's thread.
  using SharedUpload = std::shared_ptr<store::Upload>;
  awaitable<store::Result<SharedUpload>> begin_upload(std::string name, bool replace, proto::Bytes directory);
  awaitable<store::Status> append(SharedUpload upload, std::uint32_t packet, std::uint64_t offset, proto::Bytes bytes);
  awaitable<store::Result<store::Inserted>> commit(SharedUpload upload);

  /// `told` is called, on the loop, when a mesh was replaced or removed: it can be read for `grace` more, if somebody
  /// holds it.
  void on_retired(std::function<void(store::MeshId, Duration grace)> told) { on_retired_ = std::move(told); }
  /// Deletes the retired meshes that an earlier run has left, in the background; to be called once, at the start.
  awaitable<void> collect_leftovers() { return collector_.collect_leftovers(); }
  /// At the end of the daemon: what is retired now is deleted after the next start. Afterwards no task of the catalog
  /// waits for anything but the database.
  void stop() { collector_.stop(); }

  [[nodiscard]] CacheStatus cache_status() const;

 private:
  /// A packet that is being read, and those who wait for it.
  struct Reading {
    explicit Reading(const Executor& executor) : done(executor) {}
    std::optional<store::Result<SharedBytes>> answer;
    bool gone = false;  ///< its mesh went meanwhile
    Condition done;
  };
  /// The mesh list where it is made: on the reader's thread, and touched by nothing else.
  struct ListOnReader;

  void changed();
  void retire(store::MeshId mesh);
  /// The mesh may not be read from now on.
  void gone(store::MeshId mesh);

  TaskGroup& tasks_;
  store::StoreThread& reader_;
  store::StoreThread& writer_;
  std::shared_ptr<store::UploadBudget> budget_;
  Collector collector_;
  HeldMeshes held_;
  PacketCache cache_;
  std::uint64_t hits_ = 0;
  std::uint64_t misses_ = 0;
  std::uint64_t reads_ = 0;
  std::map<PacketKey, std::shared_ptr<Reading>> reading_;
  std::uint64_t version_ = 0;    ///< of the database, raised by each change
  std::uint64_t collected_ = 0;  ///< meshes that may not be read any more
  std::shared_ptr<ListOnReader> list_;
  ListSize list_size_;
  SharedBytes first_page_;  ///< of the whole list of this version, once somebody asked
  std::function<void(store::MeshId, Duration)> on_retired_;
};

}  // namespace pmcd::net
