// SPDX-License-Identifier: MIT
// Calls to the store threads and back, and what of their answers is kept.
#include "daemon/net/catalog.h"

#include <spdlog/spdlog.h>

#include <new>
#include <utility>

namespace pmcd::net {
namespace {

/// On the reader's thread: a long directory takes its time.
store::Result<CatalogMesh> catalog_mesh(store::Result<store::Mesh> found) {
  if (!found) return found.error();
  const store::Mesh& mesh = found.value();
  codec::Directory directory;
  directory.format_version = mesh.summary.format_version;
  directory.lossless = mesh.summary.lossless;
  directory.generation = mesh.summary.generation;
  directory.lattice = mesh.summary.lattice;
  directory.box_min = mesh.summary.box_min;
  directory.box_max = mesh.summary.box_max;
  directory.levels = mesh.levels;
  proto::Bytes bytes = codec::serialize(directory);
  auto profile = make_profile(mesh);
  return CatalogMesh{std::move(found).value(), std::move(bytes), std::move(profile)};
}

store::Error mesh_gone() {
  return {store::ErrorCode::unknown_mesh, "the mesh was replaced or removed"};
}

void log_damaged(const store::MeshList& list) {
  for (const auto& [name, error] : list.damaged) {
    spdlog::error("mesh \"{}\" is not listed: {}: {}", name, store::error_name(error.code), error.detail);
  }
}

}  // namespace

struct Catalog::ListOnReader {
  std::uint64_t version = 0;
  std::optional<MeshIndex> index;
};

Catalog::Catalog(TaskGroup& tasks, store::StoreThread& reader, store::StoreThread& writer,
                 const CatalogOptions& options)
    : tasks_(tasks),
      reader_(reader),
      writer_(writer),
      budget_(std::make_shared<store::UploadBudget>(options.uploads)),
      collector_(tasks, writer, options.grace, [this](store::MeshId mesh) { gone(mesh); }),
      held_(collector_),
      cache_(options.cache_bytes),
      list_(std::make_shared<ListOnReader>()) {}

awaitable<store::Result<SharedBytes>> Catalog::mesh_list(std::string filter, std::string after, std::uint32_t most) {
  const bool first = filter.empty() && after.empty() && (most == 0 || most >= proto::kMaxPageEntries);
  if (first && first_page_) co_return first_page_;
  const std::uint64_t version = version_;
  struct Made {
    SharedBytes page;
    ListSize size;
  };
  auto work = [list = list_, version, filter = std::move(filter), after = std::move(after),
               most](store::MeshStore& store) -> store::Result<Made> {
    if (!list->index || list->version != version) {
      const auto stored = store.list();
      if (!stored) return stored.error();
      log_damaged(stored.value());
      list->index.emplace(stored.value().meshes);
      list->version = version;
    }
    return Made{std::make_shared<const proto::Bytes>(proto::encode_mesh_page(list->index->page(filter, after, most))),
                list->index->size()};
  };
  const auto made = co_await on_store(tasks_.executor(), reader_, std::move(work));
  if (!made) co_return made.error();
  list_size_ = made.value().size;
  if (first && version == version_) first_page_ = made.value().page;
  co_return made.value().page;
}

awaitable<store::Result<SharedMesh>> Catalog::find(std::string name) {
  if (auto held = held_.find(name)) co_return held;
  while (true) {
    const std::uint64_t version = version_;
    auto work = [name](store::MeshStore& store) { return catalog_mesh(store.find(name)); };
    auto found = co_await on_store(tasks_.executor(), reader_, std::move(work));
    if (!found) co_return found.error();
    // If it was replaced or removed while the answer was on its way, the name means something else by now.
    if (collector_.is_retired(found.value().mesh.summary.id)) continue;
    auto mesh = held_.hold(std::move(found).value());
    if (version == version_) held_.found_by_name(mesh);
    co_return mesh;
  }
}

awaitable<store::Result<SharedMesh>> Catalog::find_generation(std::uint64_t generation) {
  if (auto held = held_.find_generation(generation)) co_return held;
  const std::uint64_t version = version_;
  const std::uint64_t collected = collected_;
  auto work = [generation](store::MeshStore& store) { return catalog_mesh(store.find_generation(generation)); };
  auto found = co_await on_store(tasks_.executor(), reader_, std::move(work));
  if (!found) co_return found.error();
  const store::MeshId id = found.value().mesh.summary.id;
  if (collector_.is_gone(id)) co_return mesh_gone();
  auto mesh = held_.hold(std::move(found).value());
  const bool live = version == version_ && collected == collected_ && !collector_.is_retired(id);
  if (live) held_.found_by_generation(mesh);
  co_return mesh;
}

awaitable<store::Result<SharedBytes>> Catalog::read_packet(store::MeshId mesh, std::uint32_t packet) {
  if (SharedBytes cached = cached_packet(mesh, packet)) co_return cached;
  ++misses_;
  if (collector_.is_gone(mesh)) co_return mesh_gone();
  const PacketKey key{mesh, packet};
  if (const auto it = reading_.find(key); it != reading_.end()) {
    const std::shared_ptr<Reading> reading = it->second;
    while (!reading->answer) co_await reading->done.wait_until();
    co_return *reading->answer;
  }
  const auto reading = std::make_shared<Reading>(tasks_.executor());
  reading_.emplace(key, reading);
  ++reads_;
  try {
    auto work = [mesh, packet](store::MeshStore& store) -> store::Result<SharedBytes> {
      auto read = store.read_packet(mesh, packet);
      if (!read) return read.error();
      return SharedBytes(std::make_shared<const proto::Bytes>(std::move(read).value()));
    };
    auto answer = co_await on_store(tasks_.executor(), reader_, std::move(work));
    if (reading->gone) answer = mesh_gone();
    if (answer) cache_.put(key, answer.value());
    reading->answer = std::move(answer);
  } catch (const std::bad_alloc&) {
    reading->answer = store::Error{store::ErrorCode::out_of_memory, "out of memory"};
  }
  reading_.erase(key);
  reading->done.notify();
  co_return *reading->answer;
}

SharedBytes Catalog::cached_packet(store::MeshId mesh, std::uint32_t packet) {
  SharedBytes cached = cache_.find({mesh, packet});
  if (cached) ++hits_;
  return cached;
}

awaitable<store::Result<store::Removed>> Catalog::remove(std::string name) {
  auto work = [name = std::move(name)](store::MeshStore& store) { return store.remove(name); };
  auto removed = co_await on_store(tasks_.executor(), writer_, std::move(work));
  if (removed) {
    changed();
    retire(removed.value().mesh);
  }
  co_return removed;
}

awaitable<store::Result<Catalog::SharedUpload>> Catalog::begin_upload(std::string name, bool replace,
                                                                      proto::Bytes directory) {
  auto work = [budget = budget_, name = std::move(name), replace,
               directory = std::move(directory)](store::MeshStore& store) -> store::Result<SharedUpload> {
    auto begun = store::Upload::begin(store, budget, name, replace, directory);
    if (!begun) return begun.error();
    return SharedUpload(std::move(begun).value());
  };
  co_return co_await on_store(tasks_.executor(), writer_, std::move(work));
}

awaitable<store::Status> Catalog::append(SharedUpload upload, std::uint32_t packet, std::uint64_t offset,
                                         proto::Bytes bytes) {
  auto work = [upload = std::move(upload), packet, offset, bytes = std::move(bytes)](store::MeshStore&) {
    return upload->append(packet, offset, bytes);
  };
  co_return co_await on_store(tasks_.executor(), writer_, std::move(work));
}

awaitable<store::Result<store::Inserted>> Catalog::commit(SharedUpload upload) {
  auto work = [upload = std::move(upload)](store::MeshStore& store) { return upload->commit(store); };
  auto inserted = co_await on_store(tasks_.executor(), writer_, std::move(work));
  if (inserted) {
    changed();
    if (inserted.value().retired) retire(*inserted.value().retired);
  }
  co_return inserted;
}

CacheStatus Catalog::cache_status() const {
  return {hits_, misses_, reads_, cache_.packets(), cache_.bytes(), cache_.limit()};
}

void Catalog::changed() {
  ++version_;
  first_page_.reset();
  held_.changed();
}

void Catalog::retire(store::MeshId mesh) {
  collector_.retire(mesh, held_.retire(mesh));
  if (on_retired_) on_retired_(mesh, collector_.grace());
}

void Catalog::gone(store::MeshId mesh) {
  ++collected_;
  held_.retire(mesh);  // one that an earlier run has left was not retired by retire()
  cache_.drop(mesh);
  for (auto it = reading_.lower_bound({mesh, 0}); it != reading_.end() && it->first.mesh == mesh; ++it) {
    it->second->gone = true;
  }
}

}  // namespace pmcd::net
