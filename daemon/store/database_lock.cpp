// SPDX-License-Identifier: MIT
#include "daemon/store/database_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace pmcd::store {

Result<DatabaseLock> DatabaseLock::take(const std::string& database) {
  // One lock, whatever links lead to the database.
  std::error_code ignored;
  std::filesystem::path path = std::filesystem::weakly_canonical(database, ignored);
  if (path.empty()) path = database;
  path += ".lock";
  DatabaseLock lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (lock.fd_ < 0) {
    // Where there is no folder, that is not for want of this file.
    const std::string what = errno == ENOENT ? database : path.string();
    return Error{ErrorCode::database_failed, what + ": " + std::strerror(errno)};
  }
  if (::flock(lock.fd_, LOCK_EX | LOCK_NB) == 0) return lock;
  if (errno == EWOULDBLOCK) {
    return Error{ErrorCode::database_locked, "another pmcd serves it and holds " + path.string()};
  }
  return Error{ErrorCode::database_failed, path.string() + ": " + std::strerror(errno)};
}

DatabaseLock::~DatabaseLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace pmcd::store
