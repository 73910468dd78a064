// SPDX-License-Identifier: MIT
// The spool file in system calls: O_TMPFILE where the file system has it, an unlinked file elsewhere.
#include "daemon/store/spool.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace pmcd::store {
namespace {

Error failure(const char* what) {
  const int number = errno;
  const bool full = number == ENOSPC || number == EDQUOT || number == EFBIG;
  const ErrorCode code = full               ? ErrorCode::no_space
                         : number == ENOMEM ? ErrorCode::out_of_memory
                                            : ErrorCode::database_failed;
  return {code, std::string("upload file: ") + what + ": " + std::strerror(number)};
}

int open_unnamed(const std::string& folder) {
  const int fd = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)) return fd;
  std::string path = folder + "/.pmcd-upload-XXXXXX";
  const int named = ::mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(path.c_str());
  return named;
}

}  // namespace

Result<Spool> Spool::make(const std::string& folder) {
  const int fd = open_unnamed(folder);
  if (fd < 0) return failure("cannot be made");
  return Spool(fd);
}

Spool::Spool(Spool&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), size_(other.size_), mapped_(std::exchange(other.mapped_, nullptr)) {}

Spool::~Spool() {
  if (mapped_ != nullptr) ::munmap(mapped_, size_);
  if (fd_ >= 0) ::close(fd_);
}

Status Spool::append(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failure("cannot be written");
    size_ += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return Done{};
}

Result<std::span<const std::byte>> Spool::map() {
  if (size_ == 0) return std::span<const std::byte>();
  if (mapped_ == nullptr) {
    void* const at = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, fd_, 0);
    if (at == MAP_FAILED) return failure("cannot be mapped");
    mapped_ = at;
  }
  return std::span(static_cast<const std::byte*>(mapped_), static_cast<std::size_t>(size_));
}

}  // namespace pmcd::store
