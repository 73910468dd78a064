// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes whole files with plain system calls, so that each failure is known with its reason.
#include "codec/import/file_io.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>

namespace pmcd::import {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() { close_now(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }
  /// False if the operating system reports that something was not written.
  bool close_now() {
    const int fd = fd_;
    fd_ = -1;
    return fd < 0 || ::close(fd) == 0;
  }

 private:
  int fd_;
};

std::string reason(int error) {
  return std::generic_category().message(error);
}

ImportError failure(ImportErrorCode code, const std::string& path, std::string message) {
  ImportError error;
  error.code = code;
  error.file = path;
  error.message = std::move(message);
  return error;
}

/// 0 or the errno of the failure.
int write_all(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}

}  // namespace

ImportResult<std::vector<std::byte>> load_file(const std::string& path) {
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return failure(ImportErrorCode::cannot_read, path, "cannot be opened: " + reason(errno));
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) {
    return failure(ImportErrorCode::cannot_read, path, "cannot be read: " + reason(errno));
  }
  if (!S_ISREG(status.st_mode)) {
    return failure(
        ImportErrorCode::cannot_read, path,
        S_ISDIR(status.st_mode) ? "is a directory; name a file in it" : "is not a regular file; copy it to one");
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t got = ::read(file.get(), bytes.data() + have, bytes.size() - have);
    if (got < 0) {
      if (errno == EINTR) continue;
      return failure(ImportErrorCode::cannot_read, path, "cannot be read: " + reason(errno));
    }
    if (got == 0) break;  // shortened while we read
    have += static_cast<std::size_t>(got);
  }
  bytes.resize(have);
  return bytes;
}

ImportFailure save_file(const std::string& path, std::span<const std::byte> bytes) {
  const auto refuse = [&](int error) {
    return failure(ImportErrorCode::cannot_write, path, "cannot be written: " + reason(error));
  };
  std::string target = path;
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) {
      return failure(ImportErrorCode::cannot_write, path, "is a directory; name a file in it");
    }
    if (!S_ISREG(status.st_mode)) {
      Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
      if (file.get() < 0) return refuse(errno);
      if (const int error = write_all(file.get(), bytes)) return refuse(error);
      return {};
    }
    std::error_code ignored;
    const std::filesystem::path resolved = std::filesystem::canonical(path, ignored);
    if (!ignored) target = resolved.string();
  }

  static std::atomic<unsigned> counter{0};
  const std::string temporary =
      target + ".part-" + std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1));
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.get() < 0) return refuse(errno);
  int error = write_all(file.get(), bytes);
  // Without this a power cut could leave the new name with nothing behind it.
  if (error == 0 && ::fsync(file.get()) != 0 && errno != EINVAL) error = errno;
  if (!file.close_now() && error == 0) error = errno;
  if (error == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error == 0) return {};
  ::unlink(temporary.c_str());
  return refuse(error);
}

std::string extension_of(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  if (!extension.empty()) extension.erase(0, 1);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return extension;
}

}  // namespace pmcd::import
