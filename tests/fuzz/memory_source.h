// SPDX-License-Identifier: MIT
// The store of the session fuzzer: a few meshes in memory that come, are replaced, removed and lost as the script says,
// and whose answers may be late, out of order, or failures. It remembers what a client may have been told.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/net/mesh_source.h"

namespace pmcd::fuzz {

/// What can be stored: the packets of one generation. Always the same.
struct Content {
  std::vector<net::SharedBytes> packets;
  store::Mesh mesh;  ///< without name and id
  proto::Bytes directory;
};
const std::vector<Content>& contents();
/// Null if no content has this generation.
const Content* content_of(std::uint64_t generation);

class MemorySource final : public net::MeshSource {
 public:
  explicit MemorySource(const net::Executor& executor) : executor_(executor) {}

  /// Stores a content under a name. The mesh that gave way, if there was one, is retired.
  std::optional<store::MeshId> put(const std::string& name, const Content& content);
  /// The mesh that was retired, if there was one of that name.
  std::optional<store::MeshId> remove(const std::string& name);
  /// A retired mesh is gone for good: the `index`-th of those that are left.
  void collect(std::size_t index);

  /// Whether answers wait for answer() from now on, and whether packets that were read are there at once.
  void set_late(bool late) { late_ = late; }
  void set_caching(bool caching) { caching_ = caching; }
  /// Lets the `index`-th of the waiting calls go on; `fail`: it finds a damaged database.
  void answer(std::size_t index, bool fail);
  /// The same for all that a session's own coroutine waits for, or for really all.
  void answer_lookups();
  void answer_all();
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

  // What a client may hear.
  [[nodiscard]] bool has_failed() const { return failures_ > 0; }
  [[nodiscard]] bool has_lost() const { return lost_ > 0; }
  /// A mesh of this name was never absent.
  [[nodiscard]] bool always_there(const std::string& name) const;
  /// The name had this generation at some time.
  [[nodiscard]] bool ever_had(const std::string& name, std::uint64_t generation) const;
  /// These bytes were given out as a page of the list.
  [[nodiscard]] bool gave_page(const proto::Bytes& page) const { return pages_.contains(page); }

  net::awaitable<store::Result<net::SharedBytes>> mesh_list(std::string filter, std::string after,
                                                            std::uint32_t most) override;
  [[nodiscard]] std::uint64_t mesh_list_bytes(std::uint32_t most) const override;
  net::awaitable<store::Result<net::SharedMesh>> find(std::string name) override;
  net::awaitable<store::Result<net::SharedMesh>> find_generation(std::uint64_t generation) override;
  net::awaitable<store::Result<net::SharedBytes>> read_packet(store::MeshId mesh, std::uint32_t packet) override;
  net::SharedBytes cached_packet(store::MeshId mesh, std::uint32_t packet) override;

 private:
  struct Stored {
    const Content* content = nullptr;
    net::SharedMesh shared;
    std::set<std::uint32_t> cached;
  };
  struct Waiting {
    Waiting(const net::Executor& executor, bool is_lookup) : lookup(is_lookup), answered(executor) {}
    bool lookup;
    bool done = false;
    bool fail = false;
    net::Condition answered;
  };

  /// Waits if answers are late. Whether the call is to fail.
  net::awaitable<bool> wait(bool lookup);

  net::Executor executor_;
  bool late_ = false;
  bool caching_ = false;
  std::map<store::MeshId, Stored> meshes_;  ///< live and retired
  std::map<std::string, store::MeshId> live_;
  std::vector<store::MeshId> retired_;
  store::MeshId next_id_ = 1;
  std::deque<std::shared_ptr<Waiting>> waiting_;

  std::size_t failures_ = 0;
  std::size_t lost_ = 0;
  std::set<std::string> was_absent_;
  std::set<std::pair<std::string, std::uint64_t>> had_;
  std::set<proto::Bytes> pages_;
};

}  // namespace pmcd::fuzz
