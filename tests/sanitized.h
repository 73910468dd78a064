// SPDX-License-Identifier: MIT
// Whether a sanitizer is built in. It takes memory, time and descriptors of its own: figures that bound the daemon's do
// not hold with it, and tests of many random inputs try fewer.
#pragma once

namespace pmcd::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

/// How many random inputs to try: all, or the first quarter with sanitizers, which take several times as long and look
/// at what every single input touches. Without them the same test goes through all of these inputs.
constexpr unsigned rounds(unsigned all) {
  return kSanitized ? all / 4 : all;
}

}  // namespace pmcd::test
