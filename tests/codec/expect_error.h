// SPDX-License-Identifier: MIT
// For tests of fields and containers: bytes given as numbers, and a refusal with its name and its place.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "codec/result.h"
#include "tests/codec/support.h"

namespace pmcd::codec::testing {

using Bytes = std::vector<std::byte>;

inline Bytes bytes_of(std::initializer_list<int> values) {
  Bytes bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

template <typename T>
void expect_error(const Result<T>& result, ErrorCode code, std::uint64_t where) {
  ASSERT_FALSE(result.ok());
  EXPECT_STREQ(error_name(result.error().code), error_name(code)) << result.error().detail;
  EXPECT_EQ(result.error().where, where) << result.error().detail;
}

}  // namespace pmcd::codec::testing
