// SPDX-License-Identifier: GPL-3.0-or-later
// Reading, checking and appending with plain system calls.
#include "client/tool/part_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "codec/import/file_io.h"
#include "codec/packet/header.h"

namespace pmcd::tool {

// Named without import:: because clang-format takes a line that begins with "import" for a module's.
using import::ImportError;
using import::ImportFailure;
using import::ImportResult;

namespace {

std::string reason(int error) {
  return std::generic_category().message(error);
}

/// Whether the bytes can be the beginning of packet `level`: as far as its header is there, it must be the right one.
bool may_begin(proto::ByteView bytes, std::uint32_t level, const codec::Directory& directory) {
  const auto header = codec::parse_packet_header(bytes);
  if (!header) return header.error().code == codec::ErrorCode::truncated;
  return header->level == level && header->is_of(directory.generation) &&
         header->crc32c == directory.levels[level].crc32c;
}

bool is_packet(proto::ByteView bytes, std::uint32_t level, const codec::Directory& directory) {
  return may_begin(bytes, level, directory) && codec::check_packet(bytes).ok();
}

}  // namespace

PartFile::~PartFile() {
  if (fd_ >= 0) ::close(fd_);
}

bool PartFile::exists() const {
  struct stat status {};
  return ::lstat(path_.c_str(), &status) == 0;
}

ImportError PartFile::error(import::ImportErrorCode code, const std::string& what) const {
  ImportError error;
  error.code = code;
  error.file = path_;
  error.message = what;
  return error;
}

ImportFailure PartFile::open(int flags) {
  const auto refuse = [this](const std::string& why) {
    return error(import::ImportErrorCode::cannot_write, "cannot keep a partial download here: " + why);
  };
  fd_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | flags, 0666);
  if (fd_ < 0) return refuse(errno == ELOOP ? "it is a symbolic link" : reason(errno));
  struct stat status {};
  if (::fstat(fd_, &status) != 0) return refuse(reason(errno));
  if (!S_ISREG(status.st_mode)) return refuse("it is not a regular file");
  if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    return refuse(errno == EWOULDBLOCK ? "another program is writing it" : reason(errno));
  }
  return {};
}

void PartFile::set_directory(const codec::Directory& directory, std::uint64_t directory_bytes) {
  starts_.clear();
  std::uint64_t at = directory_bytes;
  for (const codec::LevelEntry& level : directory.levels) {
    starts_.push_back(at);
    at += level.bytes;
  }
}

ImportFailure PartFile::cut(std::uint64_t size) {
  if (::ftruncate(fd_, static_cast<off_t>(size)) != 0) {
    return error(import::ImportErrorCode::cannot_write, "cannot be written: " + reason(errno));
  }
  size_ = size;
  return {};
}

ImportResult<std::optional<PartFile::Loaded>> PartFile::load() {
  if (!exists()) return std::optional<Loaded>{};
  if (auto failure = open(0)) return *failure;
  const auto bytes = import::load_file(path_);
  if (!bytes) return bytes.error();
  const auto parsed = codec::parse_directory(*bytes);
  if (!parsed || parsed->directory.levels.empty()) {
    bytes_lost_ = bytes->size();
    return std::optional<Loaded>{};
  }
  const codec::Directory& directory = parsed->directory;
  proto::ByteView rest = proto::ByteView(*bytes).subspan(parsed->size);
  Loaded loaded;
  loaded.state.generation = directory.generation;
  loaded.state.directory_bytes.assign(bytes->begin(), bytes->begin() + static_cast<std::ptrdiff_t>(parsed->size));
  std::uint32_t level = 0;
  for (; level < directory.levels.size() && rest.size() >= directory.levels[level].bytes; ++level) {
    const proto::ByteView packet = rest.first(directory.levels[level].bytes);
    if (!is_packet(packet, level, directory)) break;
    loaded.packets.emplace_back(packet.begin(), packet.end());
    rest = rest.subspan(packet.size());
  }
  loaded.state.packets_done = level;
  if (level < directory.levels.size() && rest.size() < directory.levels[level].bytes &&
      may_begin(rest, level, directory)) {
    loaded.state.partial.assign(rest.begin(), rest.end());
    rest = {};
  }
  loaded.bytes_dropped = rest.size();
  set_directory(directory, parsed->size);
  if (auto failure = cut(bytes->size() - rest.size())) return *failure;
  return std::optional<Loaded>(std::move(loaded));
}

ImportFailure PartFile::begin(const codec::Directory& directory, proto::ByteView directory_bytes) {
  if (fd_ < 0) {
    if (auto failure = open(O_CREAT | O_EXCL)) return failure;
  }
  if (auto failure = cut(0)) return failure;
  set_directory(directory, 0);
  if (auto failure = write(0, 0, directory_bytes)) return failure;
  set_directory(directory, directory_bytes.size());
  return {};
}

ImportFailure PartFile::write(std::uint32_t packet, std::uint64_t offset, proto::ByteView bytes) {
  const std::uint64_t at = starts_[packet] + offset;
  if (at < size_) {
    if (auto failure = cut(at)) return failure;
  }
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(size_));
    if (written < 0) {
      if (errno == EINTR) continue;
      return error(import::ImportErrorCode::cannot_write, "cannot be written: " + reason(errno));
    }
    size_ += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

void PartFile::remove() {
  if (fd_ < 0) return;
  ::unlink(path_.c_str());
  ::close(fd_);
  fd_ = -1;
}

}  // namespace pmcd::tool
