// SPDX-License-Identifier: MIT
// std::bit_cast for the C++ library of Debian 12's Emscripten, which lacks it; included before every source there.
#pragma once

#include <bit>

#ifndef __cpp_lib_bit_cast
namespace std {

template <typename To, typename From>
constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From));
  return __builtin_bit_cast(To, from);
}

}  // namespace std
#endif
