// SPDX-License-Identifier: MIT
// A heap of small numbered things by a key, from whose middle one may be taken. It allocates only when it grows beyond
// its largest size, because it is touched several times a chunk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace pmcd::sim {

/// Least key first, ties by number, so that the order repeats. [O(log n) each, top O(1)]
class IndexedHeap {
 public:
  using Id = std::uint32_t;

  [[nodiscard]] bool empty() const { return places_.empty(); }
  [[nodiscard]] std::size_t size() const { return places_.size(); }
  /// REQUIRES: not empty.
  [[nodiscard]] double top_key() const { return places_.front().first; }
  [[nodiscard]] Id top() const { return places_.front().second; }

  /// REQUIRES: `id` is not in it.
  void push(Id id, double key) {
    if (id >= where_.size()) where_.resize(std::size_t{id} + 1);
    where_[id] = places_.size();
    places_.emplace_back(key, id);
    rise(places_.size() - 1);
  }
  /// REQUIRES: `id` is in it.
  void erase(Id id) {
    const std::size_t hole = where_[id];
    const Place last = places_.back();
    places_.pop_back();
    if (hole == places_.size()) return;
    put(hole, last);
    rise(hole);
    sink(where_[last.second]);
  }

 private:
  using Place = std::pair<double, Id>;

  void put(std::size_t at, const Place& place) {
    places_[at] = place;
    where_[place.second] = at;
  }
  void rise(std::size_t at) {
    const Place place = places_[at];
    while (at > 0 && place < places_[(at - 1) / 2]) {
      put(at, places_[(at - 1) / 2]);
      at = (at - 1) / 2;
    }
    put(at, place);
  }
  void sink(std::size_t at) {
    const Place place = places_[at];
    while (2 * at + 1 < places_.size()) {
      std::size_t child = 2 * at + 1;
      if (child + 1 < places_.size() && places_[child + 1] < places_[child]) ++child;
      if (!(places_[child] < place)) break;
      put(at, places_[child]);
      at = child;
    }
    put(at, place);
  }

  std::vector<Place> places_;
  std::vector<std::size_t> where_;
};

}  // namespace pmcd::sim
