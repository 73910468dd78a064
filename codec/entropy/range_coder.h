// SPDX-License-Identifier: MIT
// Binary range coder (Martin 1979, in the carry-propagating form): 64-bit state, 32 bits out at a time. Encoder and
// decoder of bits under AdaptiveBit models, of raw bits and of uniform numbers. The decoder reads zeros beyond the end
// and counts them, so that damaged data end in an error and never in a wild read. It knows nothing of symbols.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codec/entropy/adaptive_bit.h"

namespace pmcd::codec {

class RangeEncoder {
 public:
  /// Appends to `out`, which must outlive the encoder and not be touched until finish().
  explicit RangeEncoder(std::vector<std::byte>& out) : out_(out), start_(out.size()) {}

  void bit(AdaptiveBit& model, bool value) {
    bit_at(model.p0(), value);
    model.update(value);
  }

  /// A decision whose bit is 0 with probability p0 / 2^16. REQUIRES: 0 < p0 < 2^16.
  void bit_at(std::uint32_t p0, bool value) {
    const std::uint64_t bound = (range_ >> AdaptiveBit::kPrecision) * p0;
    if (value) {
      add(bound);
      range_ -= bound;
    } else {
      range_ = bound;
    }
    if (range_ < kLeast) shift();
  }

  /// REQUIRES: count <= 32, value < 2^count.
  void raw(std::uint32_t value, unsigned count) {
    range_ >>= count;
    add(range_ * value);
    if (range_ < kLeast) shift();
  }

  /// A number below `count`, all equally likely. REQUIRES: value < count, count > 0.
  void uniform(std::uint32_t value, std::uint32_t count) {
    range_ /= count;
    add(range_ * value);
    if (range_ < kLeast) shift();
  }

  /// The part [low, low + width) of `total`. REQUIRES: width > 0, low + width <= total < 2^26.
  void part(std::uint32_t low, std::uint32_t width, std::uint32_t total) {
    range_ /= total;
    add(range_ * low);
    range_ *= width;
    if (range_ < kLeast) shift();
  }

  /// Ends the stream; nothing may follow. Zero bytes of the last eight are left out, earlier ones are not: a reader
  /// that misses more than eight bytes knows that the stream was cut.
  void finish() {
    // The number in [low, low + range) with the most zero bytes at its end.
    for (unsigned bits = 64; bits > 0; bits -= 8) {
      const std::uint64_t mask = ~std::uint64_t{0} >> (64 - bits);
      const std::uint64_t distance = (0 - low_) & mask;
      if (distance < range_) {
        add(distance);
        break;
      }
    }
    for (int i = 0; i < 8 && low_ != 0; ++i) {
      out_.push_back(static_cast<std::byte>(low_ >> 56));
      low_ <<= 8;
    }
  }

  /// Bits written so far, including the fraction that still waits in the state.
  [[nodiscard]] double bits_written() const {
    const int leading_zeros = std::countl_zero(range_);  // at most 31
    const double fraction = static_cast<double>(range_ << leading_zeros) / 9223372036854775808.0 - 1;
    return 8.0 * static_cast<double>(out_.size() - start_) + 1 + leading_zeros - fraction;
  }

 private:
  static constexpr std::uint64_t kLeast = std::uint64_t{1} << 32;

  void add(std::uint64_t value) {
    low_ += value;
    if (low_ >= value) return;
    // Carry: the bytes that are out already take it; there always is one below 0xFF.
    for (std::size_t i = out_.size(); i-- > start_;) {
      const auto byte = static_cast<unsigned>(out_[i]) + 1;
      out_[i] = static_cast<std::byte>(byte & 0xFF);
      if (byte <= 0xFF) return;
    }
  }

  void shift() {
    for (int i = 0; i < 4; ++i) out_.push_back(static_cast<std::byte>((low_ >> (56 - 8 * i)) & 0xFF));
    low_ <<= 32;
    range_ <<= 32;
  }

  std::vector<std::byte>& out_;
  std::size_t start_;
  std::uint64_t low_ = 0;
  std::uint64_t range_ = ~std::uint64_t{0};
};

class RangeDecoder {
 public:
  /// `in` must outlive the decoder.
  explicit RangeDecoder(std::span<const std::byte> in) : in_(in) {
    take();
    take();
  }

  bool bit(AdaptiveBit& model) {
    const bool value = bit_at(model.p0());
    model.update(value);
    return value;
  }

  /// REQUIRES: 0 < p0 < 2^16.
  bool bit_at(std::uint32_t p0) {
    const std::uint64_t bound = (range_ >> AdaptiveBit::kPrecision) * p0;
    const bool value = code_ >= bound;
    if (value) {
      code_ -= bound;
      range_ -= bound;
    } else {
      range_ = bound;
    }
    if (range_ < kLeast) shift();
    return value;
  }

  /// REQUIRES: count <= 32.
  std::uint32_t raw(unsigned count) {
    range_ >>= count;
    return number(count == 32 ? ~std::uint32_t{0} : (std::uint32_t{1} << count) - 1);
  }

  /// REQUIRES: count > 0. Always answers a number below count.
  std::uint32_t uniform(std::uint32_t count) {
    range_ /= count;
    return number(count - 1);
  }

  /// Which number below `count` was coded as the part [cumulative(i), cumulative(i + 1)) of cumulative(count).
  /// `cumulative` rises strictly from 0 to less than 2^26; `guess` answers a number below count near the one whose part
  /// holds the value it is told. [logarithmic in the guess's distance]
  template <typename Guess, typename Cumulative>
  std::uint32_t symbol(std::uint32_t count, const Guess& guess, const Cumulative& cumulative) {
    range_ /= cumulative(count);
    const std::uint64_t scaled = code_ / range_;
    // The answer lies in [low, high); cumulative(low) <= scaled.
    std::uint32_t low = guess(scaled);
    std::uint32_t at_low = cumulative(low);
    std::uint32_t high = low + 1;
    std::uint32_t at_high = 0;
    std::uint32_t step = 1;
    if (at_low > scaled) {
      do {
        high = low;
        at_high = at_low;
        low = low > step ? low - step : 0;
        step *= 2;
        at_low = cumulative(low);
      } while (at_low > scaled);
    } else {
      for (;; step *= 2) {
        at_high = cumulative(high);
        if (at_high > scaled || high == count) break;
        low = high;
        at_low = at_high;
        high = count - high > step ? high + step : count;
      }
    }
    while (high - low > 1) {
      const std::uint32_t middle = low + (high - low) / 2;
      const std::uint32_t at_middle = cumulative(middle);
      if (at_middle <= scaled) {
        low = middle;
        at_low = at_middle;
      } else {
        high = middle;
        at_high = at_middle;
      }
    }
    // Only in the sliver that division leaves, which no encoder uses, does the code lie beyond the last part.
    code_ -= range_ * at_low;
    range_ *= at_high - at_low;
    if (code_ >= range_) code_ = range_ - 1;
    if (range_ < kLeast) shift();
    return low;
  }

  /// Whether more was read than an honest stream can need: then what was decoded means nothing.
  [[nodiscard]] bool overrun() const { return missing_ > 8; }
  /// Whether every byte was consumed (REQUIRES that decoding is complete): an honest stream has no byte too many.
  [[nodiscard]] bool at_end() const { return position_ == in_.size(); }

 private:
  static constexpr std::uint64_t kLeast = std::uint64_t{1} << 32;

  std::uint32_t number(std::uint32_t most) {
    std::uint64_t value = code_ / range_;
    if (value > most) value = most;  // only in the sliver that division leaves, which no encoder uses
    code_ -= value * range_;
    if (range_ < kLeast) shift();
    return static_cast<std::uint32_t>(value);
  }

  void shift() {
    range_ <<= 32;
    take();
  }

  void take() {
    for (int i = 0; i < 4; ++i) {
      code_ <<= 8;
      if (position_ < in_.size()) {
        code_ |= static_cast<std::uint64_t>(in_[position_++]);
      } else {
        ++missing_;
      }
    }
  }

  std::span<const std::byte> in_;
  std::size_t position_ = 0;
  std::size_t missing_ = 0;
  std::uint64_t code_ = 0;
  std::uint64_t range_ = ~std::uint64_t{0};
};

}  // namespace pmcd::codec
