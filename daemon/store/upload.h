// SPDX-License-Identifier: MIT
// One mesh on its way into the database: directory first, then the packets in order, then commit. Until commit() has
// returned nothing of it is visible, and dropping the object leaves nothing. Its bytes wait in a spool file, not in
// memory, and all uploads together stay under a budget.
// Thread rule: one thread at a time uses an upload; it may be destroyed on any.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "codec/packet/directory.h"
#include "daemon/store/mesh_store.h"
#include "daemon/store/result.h"
#include "daemon/store/spool.h"

namespace pmcd::store {

struct UploadLimits {
  std::uint64_t bytes_each = std::uint64_t{4} << 30;
  std::uint64_t bytes_all = std::uint64_t{8} << 30;  ///< of all uploads under way
};

/// How much of bytes_all is promised to uploads. Shared: the last upload may go after whoever made the budget.
class UploadBudget {
 public:
  explicit UploadBudget(const UploadLimits& limits) : limits_(limits) {}

  /// Error: too_large; then nothing was taken.
  Status take(std::uint64_t bytes);
  void give_back(std::uint64_t bytes) { taken_ -= bytes; }
  [[nodiscard]] std::uint64_t taken() const { return taken_; }

 private:
  const UploadLimits limits_;
  std::atomic<std::uint64_t> taken_{0};
};

class Upload {
 public:
  /// Checks the name (taken already? then `replace` must be set) and the directory, and sets its size aside.
  /// Errors: bad_name, name_taken, bad_directory, too_large, no_space, and those of SQLite.
  static Result<std::unique_ptr<Upload>> begin(MeshStore& store, std::shared_ptr<UploadBudget> budget,
                                               std::string_view name, bool replace,
                                               std::span<const std::byte> directory);
  ~Upload();
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  /// The next bytes: packet 0 from offset 0, without gaps, never over a packet's end.
  /// Errors: incomplete (a gap or a step back), bad_packet (longer than the directory says), no_space.
  Status append(std::uint32_t packet, std::uint64_t offset, std::span<const std::byte> bytes);

  /// Checks the packets and stores the mesh in one transaction. Errors: incomplete, and those of MeshStore::insert.
  Result<Inserted> commit(MeshStore& store);

  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  Upload(std::shared_ptr<UploadBudget> budget, std::string_view name, bool replace, codec::Directory directory,
         std::uint64_t bytes)
      : budget_(std::move(budget)), name_(name), replace_(replace), directory_(std::move(directory)), bytes_(bytes) {}

  std::shared_ptr<UploadBudget> budget_;
  std::string name_;
  bool replace_;
  codec::Directory directory_;
  std::uint64_t bytes_;  ///< of all packets; taken from the budget
  std::optional<Spool> spool_;
  std::size_t packet_ = 0;    ///< the next byte belongs to this packet
  std::uint64_t offset_ = 0;  ///< at this offset
};

}  // namespace pmcd::store
