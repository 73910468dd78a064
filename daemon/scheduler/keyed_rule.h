// SPDX-License-Identifier: MIT
// A rule that is a key: the waiting request with the least key goes next, ties by queued_at, then session. Whoever
// derives from it says what the key is and how it reads. It keeps the order, nothing else.
#pragma once

#include <compare>
#include <set>
#include <tuple>
#include <unordered_map>

#include "daemon/scheduler/rule.h"

namespace pmcd::scheduler {

/// REQUIRES: Key is ordered totally (no NaN). Each event O(log n), a choice O(1).
template <typename Key>
class KeyedRule : public Rule {
 public:
  void enqueued(const Request& request, const Client& client, Time now) override {
    places_.insert_or_assign(request.key, order_.insert({key_of(request, client, now), QueueOrder::of(request)}).first);
  }
  void removed(const Request& request) override {
    const auto it = places_.find(request.key);
    order_.erase(it->second);
    places_.erase(it);
  }
  [[nodiscard]] std::optional<RequestKey> next() const override {
    if (order_.empty()) return std::nullopt;
    return order_.begin()->order.key;
  }
  [[nodiscard]] std::vector<Ranked> ranking(std::size_t most, Time now) const override {
    std::vector<Ranked> ranked;
    for (auto it = order_.begin(); it != order_.end() && ranked.size() < most; ++it) {
      ranked.push_back({it->order.key, reason(it->key, it->order, now)});
    }
    return ranked;
  }
  void client_changed(const Client& client, std::span<const Request* const> waiting, Time now) override {
    for (const Request* request : waiting) {
      Iterator& place = places_.at(request->key);
      const Key key = key_of(*request, client, now);
      if (key == place->key) continue;
      auto node = order_.extract(place);
      node.value().key = key;
      place = order_.insert(std::move(node)).position;
    }
  }

 protected:
  [[nodiscard]] virtual Key key_of(const Request& request, const Client& client, Time now) const = 0;
  [[nodiscard]] virtual std::string reason(const Key& key, const QueueOrder& order, Time now) const = 0;
  /// The key under which a waiting request stands.
  [[nodiscard]] const Key& key_at(const Request& request) const { return places_.at(request.key)->key; }

 private:
  struct Place {
    Key key;
    QueueOrder order;
    bool operator<(const Place& other) const { return std::tie(key, order) < std::tie(other.key, other.order); }
  };
  using Iterator = typename std::set<Place>::iterator;

  std::set<Place> order_;
  std::unordered_map<RequestKey, Iterator> places_;
};

}  // namespace pmcd::scheduler
