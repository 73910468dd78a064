// SPDX-License-Identifier: MIT
// Calls to the store threads and back.
#include "daemon/net/catalog.h"

#include <boost/asio/executor_work_guard.hpp>
#include <type_traits>
#include <utility>

#include "proto/mesh_list.h"
#include "proto/text.h"

namespace pmcd::net {
namespace {

/// Runs `work(store)` on the store's thread and resumes the calling coroutine on `executor` with what it
/// returned.
template <typename Work>
auto on_store(asio::any_io_executor executor, store::StoreThread& thread, Work work)
    -> awaitable<std::invoke_result_t<Work, store::MeshStore&>> {
  using Answer = std::invoke_result_t<Work, store::MeshStore&>;
  auto initiate = [&thread, executor, &work](auto handler) {
    // The queue's jobs are copyable functions, the handler can only be moved: hence the shared pointers.
    auto waiting = std::make_shared<decltype(handler)>(std::move(handler));
    auto guard = std::make_shared<asio::executor_work_guard<asio::any_io_executor>>(executor);
    const auto resume = [executor, waiting, guard](Answer answer) {
      asio::post(executor, [waiting, answer = std::move(answer)]() mutable { (*waiting)(std::move(answer)); });
      guard->reset();
    };
    const bool posted =
        thread.post([work = std::move(work), resume](store::MeshStore& store) mutable { resume(work(store)); });
    if (!posted) resume(store::Error{store::ErrorCode::database_failed, "too many requests wait for the database"});
  };
  co_return co_await asio::async_initiate<const asio::use_awaitable_t<>&, void(Answer)>(std::move(initiate),
                                                                                        asio::use_awaitable);
}

proto::MeshListEntry list_entry(const store::MeshSummary& mesh) {
  proto::MeshListEntry entry;
  entry.name = mesh.name;
  entry.generation = mesh.generation;
  entry.vertices = mesh.vertices;
  entry.faces = mesh.faces;
  entry.levels = mesh.packets;
  entry.bytes = mesh.bytes;
  entry.lossless = mesh.lossless;
  entry.float64 = mesh.lattice.scalar == codec::Scalar::float64;
  entry.bits = static_cast<std::uint8_t>(mesh.lattice.bits);
  entry.format_version = mesh.format_version;
  entry.box_min = mesh.box_min;
  entry.box_max = mesh.box_max;
  return entry;
}

proto::Bytes directory_bytes(const store::Mesh& mesh) {
  codec::Directory directory;
  directory.format_version = mesh.summary.format_version;
  directory.lossless = mesh.summary.lossless;
  directory.generation = mesh.summary.generation;
  directory.lattice = mesh.summary.lattice;
  directory.box_min = mesh.summary.box_min;
  directory.box_max = mesh.summary.box_max;
  directory.levels = mesh.levels;
  return codec::serialize(directory);
}

}  // namespace

awaitable<store::Result<SharedBytes>> Catalog::mesh_list() {
  if (list_) co_return list_;
  const std::uint64_t version = version_;
  const auto meshes = co_await summaries();
  if (!meshes) co_return meshes.error();
  std::vector<proto::MeshListEntry> entries;
  entries.reserve(meshes.value().size());
  for (const store::MeshSummary& mesh : meshes.value()) {
    // Nothing is ingested under another name, but somebody else may have written to the file.
    if (proto::is_mesh_name(mesh.name)) entries.push_back(list_entry(mesh));
  }
  proto::MeshPage page;
  page.matches = static_cast<std::uint32_t>(entries.size());
  if (entries.size() > proto::kMaxPageEntries) entries.resize(proto::kMaxPageEntries);
  page.remaining = page.matches - static_cast<std::uint32_t>(entries.size());
  page.entries = std::move(entries);
  auto list = std::make_shared<const proto::Bytes>(proto::encode_mesh_page(page));
  if (version == version_) list_ = list;
  co_return SharedBytes(std::move(list));
}

awaitable<store::Result<std::shared_ptr<const CatalogMesh>>> Catalog::find(std::string name) {
  auto work = [name = std::move(name)](store::MeshStore& store) { return store.find(name); };
  auto found = co_await on_store(executor_, reader_, std::move(work));
  if (!found) co_return found.error();
  const store::MeshId id = found.value().summary.id;
  if (const auto it = meshes_.find(id); it != meshes_.end()) {
    if (auto shared = it->second.lock()) co_return shared;
  }
  auto mesh = std::make_shared<CatalogMesh>();
  mesh->directory = directory_bytes(found.value());
  mesh->mesh = std::move(found).value();
  std::erase_if(meshes_, [](const auto& entry) { return entry.second.expired(); });
  meshes_[id] = mesh;
  co_return std::shared_ptr<const CatalogMesh>(std::move(mesh));
}

awaitable<store::Result<SharedBytes>> Catalog::read_packet(store::MeshId mesh, std::uint32_t packet) {
  auto work = [mesh, packet](store::MeshStore& store) { return store.read_packet(mesh, packet); };
  auto read = co_await on_store(executor_, reader_, std::move(work));
  if (!read) co_return read.error();
  co_return std::make_shared<const proto::Bytes>(std::move(read).value());
}

awaitable<store::Result<std::vector<store::MeshSummary>>> Catalog::summaries() {
  auto work = [](store::MeshStore& store) { return store.list(); };
  co_return co_await on_store(executor_, reader_, std::move(work));
}

awaitable<store::Result<store::MeshSummary>> Catalog::remove(std::string name) {
  auto work = [name = std::move(name)](store::MeshStore& store) { return store.remove(name); };
  auto removed = co_await on_store(executor_, writer_, std::move(work));
  if (removed) changed();
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
  co_return co_await on_store(executor_, writer_, std::move(work));
}

awaitable<store::Status> Catalog::append(SharedUpload upload, std::uint32_t packet, std::uint64_t offset,
                                         proto::Bytes bytes) {
  auto work = [upload = std::move(upload), packet, offset, bytes = std::move(bytes)](store::MeshStore&) {
    return upload->append(packet, offset, bytes);
  };
  co_return co_await on_store(executor_, writer_, std::move(work));
}

awaitable<store::Result<store::Inserted>> Catalog::commit(SharedUpload upload) {
  auto work = [upload = std::move(upload)](store::MeshStore& store) { return upload->commit(store); };
  auto inserted = co_await on_store(executor_, writer_, std::move(work));
  if (inserted) changed();
  co_return inserted;
}

void Catalog::changed() {
  ++version_;
  list_.reset();
}

}  // namespace pmcd::net
