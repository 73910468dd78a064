// SPDX-License-Identifier: MIT
// A rule that is a key: the waiting request with the least key goes next, ties by queued_at, then session. Whoever
// derives from it says what the key is and how it reads. It keeps the order, nothing else.
#pragma once

#include <compare>
#include <tuple>

#include "daemon/scheduler/key_map.h"
#include "daemon/scheduler/rule.h"
#include "daemon/scheduler/sorted_blocks.h"

namespace pmcd::scheduler {

/// REQUIRES: Key is ordered totally (no NaN). Each event O(log n), a choice O(1).
template <typename Key>
class KeyedRule : public Rule {
 public:
  void enqueued(const Request& request, const Client& client, Time now) override {
    const Key key = key_of(request, client, now);
    order_.insert({key, QueueOrder::of(request)});
    *keys_.emplace(request.key).first = key;
  }
  void removed(const Request& request) override {
    order_.erase({key_at(request), QueueOrder::of(request)});
    keys_.erase(request.key);
  }
  [[nodiscard]] std::optional<RequestKey> next() const override {
    if (order_.empty()) return std::nullopt;
    return order_.front().order.key;
  }
  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time now) const override {
    std::vector<Ranked> ranked;
    order_.each([&](const Place& place) {
      if (ranked.size() == most) return false;
      ranked.push_back({place.order.key, reason(place.key, place.order, now)});
      return true;
    });
    return ranked;
  }
  void client_changed(const Client& client, std::span<const Request* const> waiting, Time now) override {
    for (const Request* request : waiting) {
      Key& standing = *keys_.find(request->key);
      const Key key = key_of(*request, client, now);
      if (key == standing) continue;
      order_.erase({standing, QueueOrder::of(*request)});
      order_.insert({key, QueueOrder::of(*request)});
      standing = key;
    }
  }

 protected:
  [[nodiscard]] virtual Key key_of(const Request& request, const Client& client, Time now) const = 0;
  [[nodiscard]] virtual std::string reason(const Key& key, const QueueOrder& order, Time now) const = 0;
  /// The key under which a waiting request stands.
  [[nodiscard]] const Key& key_at(const Request& request) const { return *keys_.find(request.key); }

 private:
  struct Place {
    Key key;
    QueueOrder order;
    bool operator<(const Place& other) const { return std::tie(key, order) < std::tie(other.key, other.order); }
  };

  SortedBlocks<Place> order_;
  KeyMap<Key> keys_;  ///< under which each stands
};

}  // namespace pmcd::scheduler
