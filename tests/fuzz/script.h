// SPDX-License-Identifier: MIT
// Reads a fuzzer's bytes as small decisions. Beyond the end everything is 0, so that every input is a whole script.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/target.h"

namespace pmcd::fuzz {

class Script {
 public:
  explicit Script(Input input) : left_(input) {}

  [[nodiscard]] bool empty() const { return left_.empty(); }
  std::uint8_t u8() {
    if (left_.empty()) return 0;
    const auto value = std::to_integer<std::uint8_t>(left_.front());
    left_ = left_.subspan(1);
    return value;
  }
  // Statements, not one expression: compilers differ in which operand they read first.
  std::uint16_t u16() {
    const std::uint8_t low = u8();
    return static_cast<std::uint16_t>(low | (u8() << 8));
  }
  std::uint32_t u32() {
    const std::uint16_t low = u16();
    return low | (std::uint32_t{u16()} << 16);
  }
  /// 0 .. count - 1. REQUIRES: 1 <= count <= 256.
  std::uint8_t below(unsigned count) { return static_cast<std::uint8_t>(u8() % count); }
  /// At most `count` bytes, as many as there are.
  Input bytes(std::size_t count) {
    const Input out = left_.first(std::min(count, left_.size()));
    left_ = left_.subspan(out.size());
    return out;
  }
  Input rest() { return bytes(left_.size()); }

 private:
  Input left_;
};

}  // namespace pmcd::fuzz
