// SPDX-License-Identifier: MIT
// A hash table from keys to small values, in one array. A node of std::unordered_map lies behind two or three cache
// misses and costs an allocation; with a hundred thousand requests that is most of what a choice would cost. Here a
// look-up is one miss. What is to stay where it is stands behind a pointer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace pmcd::scheduler {

/// Open addressing with linear probing. REQUIRES: Value is made by default and moved cheaply; no key is the largest
/// number. What find() and emplace() return holds until the next emplace() or erase().
template <typename Value>
class KeyMap {
 public:
  using Key = std::uint64_t;

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool contains(Key key) const { return find(key) != nullptr; }

  /// nullptr if it is not there. [O(1)]
  [[nodiscard]] const Value* find(Key key) const {
    if (slots_.empty()) return nullptr;
    const Slot& slot = slots_[place_of(key)];
    return slot.key == key ? &slot.value : nullptr;
  }
  [[nodiscard]] Value* find(Key key) { return const_cast<Value*>(std::as_const(*this).find(key)); }

  /// The value of `key`, a fresh one if it was not there, and whether it is. [O(1) on average over many]
  std::pair<Value*, bool> emplace(Key key) {
    if (2 * (size_ + 1) > slots_.size()) grow();
    Slot& slot = slots_[place_of(key)];
    const bool made = slot.key != key;
    if (made) {
      slot.key = key;
      ++size_;
    }
    return {&slot.value, made};
  }

  /// False if it is not there. [O(1)]
  bool erase(Key key) {
    if (slots_.empty()) return false;
    std::size_t hole = place_of(key);
    if (slots_[hole].key != key) return false;
    // Whatever was pushed beyond the hole moves up, so that a search never ends too early.
    for (std::size_t at = next(hole); slots_[at].key != kFree; at = next(at)) {
      const std::size_t from_home = (at - home_of(slots_[at].key)) & mask();
      if (from_home < ((at - hole) & mask())) continue;
      slots_[hole] = std::move(slots_[at]);
      hole = at;
    }
    slots_[hole] = Slot{};
    --size_;
    return true;
  }

  /// Calls visit(key, value) for each, in no order that means anything.
  template <typename Visit>
  void each(Visit visit) {
    for (Slot& slot : slots_) {
      if (slot.key != kFree) visit(slot.key, slot.value);
    }
  }
  template <typename Visit>
  void each(Visit visit) const {
    for (const Slot& slot : slots_) {
      if (slot.key != kFree) visit(slot.key, slot.value);
    }
  }

 private:
  static constexpr Key kFree = std::numeric_limits<Key>::max();
  static constexpr std::size_t kLeast = 16;
  struct Slot {
    Key key = kFree;
    Value value{};
  };

  [[nodiscard]] std::size_t mask() const { return slots_.size() - 1; }
  [[nodiscard]] std::size_t next(std::size_t at) const { return (at + 1) & mask(); }
  /// Keys are counted up; the golden ratio spreads them (Knuth 6.4).
  [[nodiscard]] std::size_t home_of(Key key) const { return (key * 0x9E37'79B9'7F4A'7C15ULL) >> shift_; }
  /// Where the key is, or would be put.
  [[nodiscard]] std::size_t place_of(Key key) const {
    std::size_t at = home_of(key);
    while (slots_[at].key != key && slots_[at].key != kFree) at = next(at);
    return at;
  }

  void grow() {
    std::vector<Slot> old(slots_.empty() ? kLeast : 2 * slots_.size());
    old.swap(slots_);
    shift_ = 64;
    for (std::size_t size = slots_.size(); size > 1; size /= 2) --shift_;
    for (Slot& slot : old) {
      if (slot.key != kFree) slots_[place_of(slot.key)] = std::move(slot);
    }
  }

  std::vector<Slot> slots_;  ///< a power of two, at least half of them free
  std::size_t size_ = 0;
  unsigned shift_ = 64;  ///< leaves as many bits of a product as a place has
};

}  // namespace pmcd::scheduler
