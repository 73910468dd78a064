// SPDX-License-Identifier: MIT
// The values that a coordinate of the base mesh takes, when they are few: machine parts repeat theirs. Then numbers in
// this list are coded instead of cells, and so are expectations and spreads. Without a list everything stays as it is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/entropy/integer_model.h"

namespace pmcd::codec {

class Alphabet {
 public:
  /// All cells 0..most.
  explicit Alphabet(std::int32_t most = 0) : most_(most) {}

  /// `wanted`: ascending, empty for all cells. False: damaged data. At most `limit` values are accepted.
  template <typename Source>
  bool code(Source& source, std::span<const std::int32_t> wanted, std::uint32_t limit) {
    if (source.raw(wanted.empty() ? 0 : 1, 1) == 0) return true;
    UnsignedModel length;
    UnsignedModel gap;
    const std::uint32_t count = length.code(source, static_cast<std::uint32_t>(wanted.size()));
    if (count == 0 || count > limit) return false;
    std::int64_t previous = -1;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::int32_t here = i < wanted.size() ? wanted[i] : 0;
      previous += 1 + std::int64_t{gap.code(source, static_cast<std::uint32_t>(here - previous - 1))};
      if (previous > most_ || source.failed()) return false;
      values_.push_back(static_cast<std::int32_t>(previous));
    }
    return true;
  }

  /// The largest number.
  [[nodiscard]] std::int32_t most() const {
    return values_.empty() ? most_ : static_cast<std::int32_t>(values_.size()) - 1;
  }
  /// REQUIRES: 0 <= number <= most().
  [[nodiscard]] std::int32_t cell(std::int32_t number) const {
    return values_.empty() ? number : values_[static_cast<std::size_t>(number)];
  }
  /// Where a cell, or a point between two, lies among the numbers; below the first it is 0, above the last most().
  [[nodiscard]] double number(double cell) const {
    if (!(cell > 0)) cell = 0;
    if (values_.empty()) return cell < most_ ? cell : most_;
    const auto above = std::upper_bound(values_.begin(), values_.end(), cell);
    if (above == values_.begin()) return 0;
    const auto index = static_cast<double>(above - values_.begin() - 1);
    if (above == values_.end()) return index;
    return index + (cell - *(above - 1)) / (*above - *(above - 1));
  }
  /// A spread around a cell, counted in numbers.
  [[nodiscard]] double spread(double cell, double cells) const {
    if (values_.empty()) return cells;
    const double half = (number(cell + cells) - number(cell - cells)) * 0.5;
    return half > 0.05 ? half : 0.05;
  }

 private:
  std::int32_t most_;
  std::vector<std::int32_t> values_;
};

}  // namespace pmcd::codec
