// SPDX-License-Identifier: MIT
// A result as a word, so that a test that expects one error says what came instead.
#pragma once

#include <string>

#include "daemon/store/result.h"

namespace pmcd::store {

template <typename T>
std::string outcome(const Result<T>& result) {
  return result.ok() ? "ok" : error_name(result.error().code);
}

}  // namespace pmcd::store
