// SPDX-License-Identifier: MIT
// The mesh database as coroutines see it: every call goes to a store thread and comes back, so the network loop never
// waits for SQLite. What many sessions ask for (the mesh list, a mesh's directory) is held once and shared.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/net/asio.h"
#include "daemon/net/channel.h"
#include "daemon/store/mesh_store.h"
#include "daemon/store/store_thread.h"
#include "daemon/store/upload.h"

namespace pmcd::net {

/// A mesh as sessions hold it.
struct CatalogMesh {
  store::Mesh mesh;
  proto::Bytes directory;  ///< as it travels
};

class Catalog {
 public:
  /// REQUIRES: the threads outlive the catalog and every coroutine in it.
  /// `executor`: of the coroutines that call it.
  Catalog(asio::any_io_executor executor, store::StoreThread& reader, store::StoreThread& writer,
          const store::UploadLimits& limits)
      : executor_(std::move(executor)),
        reader_(reader),
        writer_(writer),
        budget_(std::make_shared<store::UploadBudget>(limits)) {}
  Catalog(const Catalog&) = delete;
  Catalog& operator=(const Catalog&) = delete;

  /// The bytes of the answer to get_mesh_list.
  awaitable<store::Result<SharedBytes>> mesh_list();
  awaitable<store::Result<std::shared_ptr<const CatalogMesh>>> find(std::string name);
  awaitable<store::Result<SharedBytes>> read_packet(store::MeshId mesh, std::uint32_t packet);

  awaitable<store::Result<std::vector<store::MeshSummary>>> summaries();
  awaitable<store::Result<store::MeshSummary>> remove(std::string name);

  /// An ingest in steps, see Upload. The shared pointer keeps it alive while a step runs on the store's thread.
  using SharedUpload = std::shared_ptr<store::Upload>;
  awaitable<store::Result<SharedUpload>> begin_upload(std::string name, bool replace, proto::Bytes directory);
  awaitable<store::Status> append(SharedUpload upload, std::uint32_t packet, std::uint64_t offset, proto::Bytes bytes);
  awaitable<store::Result<store::Inserted>> commit(SharedUpload upload);

 private:
  void changed();

  asio::any_io_executor executor_;
  store::StoreThread& reader_;
  store::StoreThread& writer_;
  std::shared_ptr<store::UploadBudget> budget_;
  std::uint64_t version_ = 0;  ///< of the database, raised by each change
  SharedBytes list_;           ///< of this version, once somebody asked
  std::map<store::MeshId, std::weak_ptr<const CatalogMesh>> meshes_;
};

}  // namespace pmcd::net
