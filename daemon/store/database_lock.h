// SPDX-License-Identifier: MIT
// One daemon serves a database: two would each change the rule and remove meshes behind the other's back. A file beside
// the database is locked while the daemon runs, and the kernel unlocks it however the daemon ends. It is not SQLite's
// lock, which is held for a transaction only.
#pragma once

#include <string>
#include <utility>

#include "daemon/store/result.h"

namespace pmcd::store {

class DatabaseLock {
 public:
  /// Locks DATABASE.lock, which is made if it is not there and stays. Errors: database_locked, if another process has
  /// it; database_failed.
  static Result<DatabaseLock> take(const std::string& database);

  DatabaseLock(DatabaseLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  DatabaseLock& operator=(DatabaseLock&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~DatabaseLock();

 private:
  explicit DatabaseLock(int fd) : fd_(fd) {}
  int fd_ = -1;
};

}  // namespace pmcd::store
