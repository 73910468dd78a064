// SPDX-License-Identifier: MIT
// Elementary functions for probabilities that are learnt in the logistic domain (the mixing of models there is
// Mahoney's, PAQ7, 2005): logarithm, power and softmax in single precision, of + - * / in a fixed order only, so that
// every IEEE build gives the same bits. It holds no model.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cfloat>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace pmcd::codec {

static_assert(FLT_EVAL_METHOD == 0, "the codec's predictions need plain single-precision arithmetic");

/// log2 x within 0.001. REQUIRES: x > 0 and normal.
inline float fast_log2(float x) {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  const auto exponent = static_cast<float>(static_cast<std::int32_t>(bits >> 23) - 127);
  const float t = std::bit_cast<float>((bits & 0x007FFFFFu) | 0x3F800000u) - 1.0f;
  return exponent + t * (1.4391f + t * (-0.6785f + t * (0.3202f + t * -0.0808f)));
}

/// 2^x within 0.02 %. REQUIRES: -100 <= x <= 100.
inline float fast_exp2(float x) {
  const auto shifted = static_cast<std::int32_t>(x + 128.0f);  // floor: the sum is positive
  const float t = x + 128.0f - static_cast<float>(shifted);
  const float power = std::bit_cast<float>(static_cast<std::uint32_t>(shifted - 1) << 23);
  return power * (1.0f + t * (0.69580f + t * (0.22606f + t * 0.07814f)));
}

/// Four floats at a time; every lane does what a single float would, so the order of operations stays fixed.
using Four = float __attribute__((vector_size(16)));

using FourInts = std::int32_t __attribute__((vector_size(16)));

/// A pair of 16-bit integers in each lane, `low` below `high`. REQUIRES: both fit.
inline FourInts pairs_of(FourInts low, FourInts high) {
  return (low & 0xFFFF) | (high << 16);
}
/// Lane by lane: product of the low integers plus that of the high ones. Integers, so that both ways are the same.
inline FourInts dot_pairs(FourInts a, FourInts b) {
#ifdef __SSE2__
  using Eight = short __attribute__((vector_size(16)));
  return __builtin_ia32_pmaddwd128(reinterpret_cast<Eight>(a), reinterpret_cast<Eight>(b));
#else
  return ((a << 16) >> 16) * ((b << 16) >> 16) + (a >> 16) * (b >> 16);
#endif
}

inline Four load_four(const float* from) {
  Four four;
  std::memcpy(&four, from, sizeof four);
  return four;
}
inline void store_four(float* to, Four four) {
  std::memcpy(to, &four, sizeof four);
}
/// The larger in each lane, b where they do not compare; one instruction.
inline Four larger(Four a, Four b) {
#ifdef __SSE2__
  return __builtin_ia32_maxps(a, b);
#else
  return a > b ? a : b;
#endif
}
/// The smaller in each lane, b where they do not compare.
inline Four smaller(Four a, Four b) {
#ifdef __SSE2__
  return __builtin_ia32_minps(a, b);
#else
  return a < b ? a : b;
#endif
}
/// (first + second) + (third + fourth)
inline float sum_of(Four four) {
  const Four pairs = four + __builtin_shufflevector(four, four, 1, 0, 3, 2);
  return pairs[0] + pairs[2];
}

/// Floats in lanes of four, for sums of one order.
template <std::size_t kCount>
struct Lanes {
  static_assert(kCount % 4 == 0);
  alignas(16) std::array<float, kCount> value;
};

template <std::size_t kCount>
float dot(const Lanes<kCount>& a, const Lanes<kCount>& b) {
  Four sum = load_four(a.value.data()) * load_four(b.value.data());
  for (std::size_t i = 4; i < kCount; i += 4) sum += load_four(&a.value[i]) * load_four(&b.value[i]);
  return sum_of(sum);
}

/// a += k b
template <std::size_t kCount>
void add_scaled(Lanes<kCount>& a, float k, const Lanes<kCount>& b) {
  for (std::size_t i = 0; i < kCount; i += 4)
    store_four(&a.value[i], load_four(&a.value[i]) + k * load_four(&b.value[i]));
}

/// log2 of each, within 0.001. REQUIRES: positive and normal.
inline Four fast_log2(Four x) {
  FourInts bits;
  std::memcpy(&bits, &x, sizeof bits);
  const Four exponent = __builtin_convertvector((bits >> 23) - 127, Four);
  const FourInts mantissa = (bits & 0x007FFFFF) | 0x3F800000;
  Four t;
  std::memcpy(&t, &mantissa, sizeof t);
  t -= 1.0f;
  return exponent + t * (1.4391f + t * (-0.6785f + t * (0.3202f + t * -0.0808f)));
}

/// 2^x within 0.02 %. REQUIRES: -100 <= x <= 100.
inline Four fast_exp2(Four x) {
  const FourInts shifted = __builtin_convertvector(x + 128.0f, FourInts);  // floor: the sum is positive
  const Four t = x + 128.0f - __builtin_convertvector(shifted, Four);
  const FourInts bits = (shifted - 1) << 23;
  Four power;
  std::memcpy(&power, &bits, sizeof power);
  return power * (1.0f + t * (0.69580f + t * (0.22606f + t * 0.07814f)));
}

/// Scores (log2 of odds) -> probabilities, in place. REQUIRES: count > 0, finite scores, room for a multiple of four;
/// what lies beyond `count` is overwritten.
inline void softmax(float* score, std::size_t count) {
  float most = score[0];
  for (std::size_t i = 1; i < count; ++i) most = std::max(most, score[i]);
  for (std::size_t i = count; i % 4 != 0; ++i) score[i] = -1000.0f;
  Four sums{};
  for (std::size_t i = 0; i < count; i += 4) {
    Four four = load_four(score + i) - most;
    four = larger(four, Four{} - 30.0f);
    four = fast_exp2(four);
    store_four(score + i, four);
    sums += four;
  }
  const Four share = Four{} + 1.0f / sum_of(sums);
  for (std::size_t i = 0; i < count; i += 4) store_four(score + i, load_four(score + i) * share);
}

}  // namespace pmcd::codec
