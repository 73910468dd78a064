// SPDX-License-Identifier: MIT
// The boundary at which SQLite's exceptions become values.
#pragma once

#include <new>

#include "daemon/store/db.h"
#include "daemon/store/result.h"

namespace pmcd::store {

/// Runs `work`, which returns a Result, and turns what it throws into an Error.
template <typename Work>
auto guarded(Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const SqliteError& error) {
    return error.as_error();
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::out_of_memory, "out of memory"};
  }
}

}  // namespace pmcd::store
