// SPDX-License-Identifier: MIT
// The packets that were asked for last, in memory, shared by all sessions and never copied. Bounded by bytes: the
// packet that was used longest ago goes first. It reads nothing itself (catalog.h does). One thread only.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>

#include "daemon/net/shared_bytes.h"
#include "daemon/store/mesh_store.h"

namespace pmcd::net {

/// For the operator.
struct CacheStatus {
  std::uint64_t hits = 0;
  std::uint64_t misses = 0;
  std::uint64_t reads = 0;  ///< of the database; less than the misses where several asked at the same time
  std::size_t packets = 0;
  std::size_t bytes = 0;
  std::size_t limit_bytes = 0;
};

/// Names a packet for as long as the database lives.
struct PacketKey {
  store::MeshId mesh = 0;
  std::uint32_t packet = 0;
  auto operator<=>(const PacketKey&) const = default;  // NOLINT(modernize-use-nullptr): clang-tidy 14 errs
};

class PacketCache {
 public:
  /// What an entry counts beside its bytes: about what its nodes and the vector's header take.
  static constexpr std::size_t kEntryBytes = 160;
  /// A packet that would take more than this part of the cache is not kept: it would push out too many others.
  static constexpr std::size_t kLargestPart = 4;

  /// Whether a packet of `size` bytes is kept in a cache of `limit_bytes`.
  static bool takes(std::size_t size, std::size_t limit_bytes) {
    return size + kEntryBytes <= limit_bytes / kLargestPart;
  }

  /// `limit_bytes` 0: nothing is kept.
  explicit PacketCache(std::size_t limit_bytes) : limit_(limit_bytes) {}
  PacketCache(const PacketCache&) = delete;
  PacketCache& operator=(const PacketCache&) = delete;

  /// Null if it is not there; else it is now the one used last. [O(log packets)]
  SharedBytes find(const PacketKey& key);
  /// Keeps `bytes` if they are not too large, and lets others go as far as that needs.
  void put(const PacketKey& key, SharedBytes bytes);
  /// Forgets all packets of a mesh. Who holds one goes on holding it.
  void drop(store::MeshId mesh);

  [[nodiscard]] std::size_t limit() const { return limit_; }
  /// Of all packets in it, kEntryBytes each included; never over limit().
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::size_t packets() const { return entries_.size(); }

 private:
  struct Entry {
    PacketKey key;
    SharedBytes bytes;
  };
  using Order = std::list<Entry>;
  using Entries = std::map<PacketKey, Order::iterator>;

  static std::size_t cost(const SharedBytes& bytes) { return bytes->size() + kEntryBytes; }
  Entries::iterator erase(Entries::iterator entry);

  const std::size_t limit_;
  std::size_t bytes_ = 0;
  Order order_;  ///< the one used last comes first
  Entries entries_;
};

}  // namespace pmcd::net
