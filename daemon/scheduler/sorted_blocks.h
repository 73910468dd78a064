// SPDX-License-Identifier: MIT
// A sorted multiset in blocks of a few kB. With a hundred thousand values a tree costs a cache miss at each of its
// levels, and that is what a choice would cost; here a change looks through one short list of the blocks' first values
// and moves part of one block. It has no iterators that stay.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace pmcd::scheduler {

/// REQUIRES: T is ordered totally by < and cheap to move.
template <typename T>
class SortedBlocks {
 public:
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Least and greatest. REQUIRES: not empty. [O(1)]
  [[nodiscard]] const T& front() const { return blocks_.front().front(); }
  [[nodiscard]] const T& back() const { return blocks_.back().back(); }

  /// [O(log n), and the moves of a block]
  void insert(T value) {
    if (blocks_.empty()) {
      blocks_.push_back({value});
      firsts_.push_back(std::move(value));
      ++size_;
      return;
    }
    const std::size_t at = block_of(value);
    Block& block = blocks_[at];
    block.insert(std::upper_bound(block.begin(), block.end(), value), std::move(value));
    ++size_;
    if (block.size() > kMost) split(at);
    firsts_[at] = blocks_[at].front();
  }

  /// One that is equal; false if there is none. [as insert()]
  bool erase(const T& value) {
    if (blocks_.empty()) return false;
    const std::size_t at = block_of(value);
    Block& block = blocks_[at];
    const auto it = std::lower_bound(block.begin(), block.end(), value);
    if (it == block.end() || value < *it) return false;
    block.erase(it);
    --size_;
    if (block.empty()) {
      blocks_.erase(blocks_.begin() + static_cast<std::ptrdiff_t>(at));
      firsts_.erase(firsts_.begin() + static_cast<std::ptrdiff_t>(at));
    } else {
      firsts_[at] = block.front();
    }
    return true;
  }

  /// Calls visit(value) in ascending order until it answers false.
  template <typename Visit>
  void each(Visit visit) const {
    for (const Block& block : blocks_) {
      for (const T& value : block) {
        if (!visit(value)) return;
      }
    }
  }

 private:
  using Block = std::vector<T>;
  static constexpr std::size_t kMost = std::max<std::size_t>(16, 2'048 / sizeof(T));

  /// The last block that begins with no more than the value, or the first block. REQUIRES: not empty.
  [[nodiscard]] std::size_t block_of(const T& value) const {
    const auto behind = std::upper_bound(firsts_.begin(), firsts_.end(), value);
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(behind - firsts_.begin() - 1, 0));
  }

  void split(std::size_t at) {
    Block& whole = blocks_[at];
    // In ascending order, as times come, full blocks stay full.
    const std::size_t kept = at + 1 == blocks_.size() ? kMost : kMost / 2;
    const auto middle = whole.begin() + static_cast<std::ptrdiff_t>(kept);
    Block rest;
    rest.reserve(kMost + 1);
    rest.assign(middle, whole.end());
    whole.erase(middle, whole.end());
    const auto place = static_cast<std::ptrdiff_t>(at + 1);
    firsts_.insert(firsts_.begin() + place, rest.front());
    blocks_.insert(blocks_.begin() + place, std::move(rest));
  }

  std::vector<Block> blocks_;  ///< none is empty
  std::vector<T> firsts_;      ///< the first value of each
  std::size_t size_ = 0;
};

}  // namespace pmcd::scheduler
