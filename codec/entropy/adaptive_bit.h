// SPDX-License-Identifier: MIT
// The probability of one binary decision, learnt as it goes: a running mean over the first decisions, then an
// exponential window. Integer arithmetic only, so every build learns the same. No mixing of several models.
#pragma once

#include <array>
#include <cstdint>

namespace pmcd::codec {

class AdaptiveBit {
 public:
  static constexpr unsigned kPrecision = 16;  ///< p0() is a probability times 2^16

  /// Probability that the bit is 0, from 2^-11 to 1 - 2^-11.
  [[nodiscard]] std::uint32_t p0() const { return p0_; }

  void update(bool bit) {
    const std::int32_t target = bit ? kFloor : kCeiling;
    const std::int64_t step = std::int64_t{target - static_cast<std::int32_t>(p0_)} * kRate[count_] / 65536;
    p0_ = static_cast<std::uint16_t>(static_cast<std::int32_t>(p0_) + static_cast<std::int32_t>(step));
    if (count_ + 1u < kRate.size()) ++count_;
  }

 private:
  static constexpr std::int32_t kFloor = 32;
  static constexpr std::int32_t kCeiling = 65536 - kFloor;
  static constexpr std::size_t kWindow = 160;  // decisions; longer ones gain nothing on scans, shorter ones cost

  // The running mean that starts from one virtual decision of each kind, as a step towards the newest decision.
  static constexpr std::array<std::int32_t, kWindow> kRate = [] {
    std::array<std::int32_t, kWindow> rates{};
    for (std::size_t n = 0; n < kWindow; ++n) rates[n] = static_cast<std::int32_t>(65536 / (n + 3));
    return rates;
  }();

  std::uint16_t p0_ = 32768;
  std::uint16_t count_ = 0;
};

}  // namespace pmcd::codec
