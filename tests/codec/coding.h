// SPDX-License-Identifier: MIT
// The smallest Sources (codec/source.h) that write into a vector and read from it, for tests of models on their own.
// They ask no questions about meshes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/entropy/range_coder.h"

namespace pmcd::codec::testing {

class ModelWriter {
 public:
  bool bit(AdaptiveBit& model, bool value) {
    encoder_.bit(model, value);
    return value;
  }
  std::uint32_t raw(std::uint32_t value, unsigned count) {
    if (count > 0) encoder_.raw(value, count);
    return value;
  }
  template <typename Guess, typename Cumulative>
  std::uint32_t symbol(std::uint32_t value, std::uint32_t count, const Guess& /*guess*/, const Cumulative& cumulative) {
    const std::uint32_t low = cumulative(value);
    encoder_.part(low, cumulative(value + 1) - low, cumulative(count));
    return value;
  }
  [[nodiscard]] double bits() const { return encoder_.bits_written(); }
  /// Nothing may be written afterwards.
  const std::vector<std::byte>& finish() {
    encoder_.finish();
    return bytes_;
  }

 private:
  std::vector<std::byte> bytes_;
  RangeEncoder encoder_{bytes_};
};

class ModelReader {
 public:
  explicit ModelReader(std::span<const std::byte> bytes) : decoder_(bytes) {}
  bool bit(AdaptiveBit& model, bool /*value*/) { return decoder_.bit(model); }
  std::uint32_t raw(std::uint32_t /*value*/, unsigned count) { return count == 0 ? 0 : decoder_.raw(count); }
  template <typename Guess, typename Cumulative>
  std::uint32_t symbol(std::uint32_t /*value*/, std::uint32_t count, const Guess& guess, const Cumulative& cumulative) {
    return decoder_.symbol(count, guess, cumulative);
  }
  [[nodiscard]] bool overrun() const { return decoder_.overrun(); }
  [[nodiscard]] bool at_end() const { return decoder_.at_end(); }

 private:
  RangeDecoder decoder_;
};

}  // namespace pmcd::codec::testing
