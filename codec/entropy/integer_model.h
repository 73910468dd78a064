// SPDX-License-Identifier: MIT
// Integers as sequences of adaptive binary decisions (exponential Golomb codes, Teuhola 1978, with a learnt prefix).
// Written once for both directions: a Source reads or writes, and answers the value either way.
#pragma once

#include <array>
#include <cstdint>

#include "codec/entropy/adaptive_bit.h"

namespace pmcd::codec {

/// Unsigned integers up to 2^31 - 2: the length is learnt, the highest bit after the leading one too, the rest is raw.
class UnsignedModel {
 public:
  template <typename Source>
  std::uint32_t code(Source& source, std::uint32_t value) {
    const std::uint32_t shifted = value + 1;
    unsigned length = 0;  // of shifted, without its leading one
    while (length < kMaxLength && source.bit(longer_[length], (shifted >> (length + 1)) != 0)) ++length;
    if (length == 0) return 0;
    const unsigned low = length - 1;
    std::uint32_t result = 2u | (source.bit(upper_[length], ((shifted >> low) & 1) != 0) ? 1u : 0u);
    result = (result << low) | source.raw(shifted & ((1u << low) - 1), low);
    return result - 1;
  }

 private:
  static constexpr unsigned kMaxLength = 30;
  std::array<AdaptiveBit, kMaxLength> longer_;
  std::array<AdaptiveBit, kMaxLength + 1> upper_;
};

/// Signed integers of small magnitude: zero or not, sign, size.
class SignedModel {
 public:
  template <typename Source>
  std::int32_t code(Source& source, std::int32_t value) {
    if (!source.bit(nonzero_, value != 0)) return 0;
    const bool negative = source.bit(negative_, value < 0);
    const std::uint32_t size = magnitude_.code(source, static_cast<std::uint32_t>(negative ? -value : value) - 1) + 1;
    return negative ? -static_cast<std::int32_t>(size) : static_cast<std::int32_t>(size);
  }

 private:
  AdaptiveBit nonzero_;
  AdaptiveBit negative_;
  UnsignedModel magnitude_;
};

}  // namespace pmcd::codec
