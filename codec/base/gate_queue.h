// SPDX-License-Identifier: MIT
// In which order the base mesh grows: a queue of half-edges by urgency. The order is total, so that every library's
// heap answers the same.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace pmcd::codec {

/// Gates of the growing region: the most urgent first, of equals the oldest.
class GateQueue {
 public:
  void push(double urgency, std::uint32_t gate) {
    heap_.push_back({urgency, count_++, gate});
    std::push_heap(heap_.begin(), heap_.end(), later);
  }
  [[nodiscard]] bool empty() const { return heap_.empty(); }
  std::uint32_t pop() {
    std::pop_heap(heap_.begin(), heap_.end(), later);
    const std::uint32_t gate = heap_.back().gate;
    heap_.pop_back();
    return gate;
  }

 private:
  struct Entry {
    double urgency;
    std::uint64_t number;
    std::uint32_t gate;
  };
  static bool later(const Entry& x, const Entry& y) {
    return x.urgency != y.urgency ? x.urgency > y.urgency : x.number > y.number;
  }
  std::vector<Entry> heap_;
  std::uint64_t count_ = 0;
};

}  // namespace pmcd::codec
