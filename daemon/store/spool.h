// SPDX-License-Identifier: MIT
// A temporary file without a name that takes an upload until it is whole: the kernel deletes it with the process, so a
// kill -9 leaves nothing behind. It looks at no content and bounds nothing (upload.h does).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "daemon/store/result.h"

namespace pmcd::store {

class Spool {
 public:
  /// In `folder`, which should be on the disk of the database. Errors: no_space, database_failed.
  static Result<Spool> make(const std::string& folder);
  Spool(Spool&& other) noexcept;
  Spool& operator=(Spool&&) = delete;
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  ~Spool();

  /// Appends all of `bytes` or fails. Errors: no_space, database_failed.
  Status append(std::span<const std::byte> bytes);
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// All that was appended, mapped into memory until the spool goes; nothing may be appended after it.
  /// Errors: out_of_memory, database_failed.
  Result<std::span<const std::byte>> map();

 private:
  explicit Spool(int fd) : fd_(fd) {}

  int fd_ = -1;
  std::uint64_t size_ = 0;
  void* mapped_ = nullptr;
};

}  // namespace pmcd::store
