// SPDX-License-Identifier: MIT
// A list in the order of use and a map into it.
#include "daemon/net/packet_cache.h"

#include <utility>

namespace pmcd::net {

SharedBytes PacketCache::find(const PacketKey& key) {
  const auto it = entries_.find(key);
  if (it == entries_.end()) return nullptr;
  order_.splice(order_.begin(), order_, it->second);
  return it->second->bytes;
}

void PacketCache::put(const PacketKey& key, SharedBytes bytes) {
  if (const auto it = entries_.find(key); it != entries_.end()) erase(it);
  const std::size_t size = cost(bytes);
  if (!takes(bytes->size(), limit_)) return;
  while (bytes_ + size > limit_) erase(entries_.find(order_.back().key));
  // In this order nothing has changed if there is no memory for one of the two.
  Order fresh;
  fresh.push_front({key, std::move(bytes)});
  entries_.emplace(key, fresh.begin());
  order_.splice(order_.begin(), fresh);
  bytes_ += size;
}

void PacketCache::drop(store::MeshId mesh) {
  auto it = entries_.lower_bound({mesh, 0});
  while (it != entries_.end() && it->first.mesh == mesh) it = erase(it);
}

PacketCache::Entries::iterator PacketCache::erase(Entries::iterator entry) {
  bytes_ -= cost(entry->second->bytes);
  order_.erase(entry->second);
  return entries_.erase(entry);
}

}  // namespace pmcd::net
