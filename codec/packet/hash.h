// SPDX-License-Identifier: MIT
// The 64-bit hash that proves a decoding: of lattice indices and faces in decoder order, and of the streams' bytes
// (generation). Deterministic over compilers and byte orders. Not cryptographic.
#pragma once

#include <bit>
#include <cstdint>

namespace pmcd::codec {

/// Feed 64-bit words, then take value(). Two multiplications a word; every input bit reaches every output bit.
class Hash64 {
 public:
  void add(std::uint64_t word) {
    state_ = std::rotl(state_ ^ mix(word + kIncrement * ++count_), 27) * kMultiplier + kIncrement;
  }
  [[nodiscard]] std::uint64_t value() const { return mix(state_ ^ count_); }

 private:
  static constexpr std::uint64_t kMultiplier = 0xD6E8FEB86659FD93u;
  static constexpr std::uint64_t kIncrement = 0x9E3779B97F4A7C15u;

  // The xor-shift-multiply finaliser that D. Stafford measured for MurmurHash3 (variant 13).
  static std::uint64_t mix(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
    return x ^ (x >> 31);
  }

  std::uint64_t state_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace pmcd::codec
