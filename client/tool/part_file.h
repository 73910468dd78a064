// SPDX-License-Identifier: GPL-3.0-or-later
// A partial download beside its output: the beginning of a .pmcd file (directory, then packets, the last one possibly
// cut), written as bytes come, so that a program that is killed loses little. Knows no server and decodes nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/fetch.h"
#include "codec/import/error.h"
#include "codec/packet/directory.h"
#include "proto/bytes.h"

namespace pmcd::tool {

class PartFile {
 public:
  struct Loaded {
    client::FetchState state;
    std::vector<proto::Bytes> packets;  ///< whole and right, as many as state.packets_done
    std::uint64_t bytes_dropped = 0;    ///< behind them, because they were damaged
  };

  explicit PartFile(std::string path) : path_(std::move(path)) {}
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  /// Something of that name is there.
  [[nodiscard]] bool exists() const;

  /// Takes up an existing file: checks the directory and packet by packet, and cuts off what is damaged. nullopt if
  /// there is no file, or nothing right in it (bytes_lost then says how much was there). Errors: cannot_read,
  /// cannot_write (somebody else writes it).
  import::ImportResult<std::optional<Loaded>> load();
  /// Bytes of a file in which nothing was right.
  [[nodiscard]] std::uint64_t bytes_lost() const { return bytes_lost_; }

  /// Begins (anew) with this directory. Errors: cannot_write.
  import::ImportFailure begin(const codec::Directory& directory, proto::ByteView directory_bytes);
  /// REQUIRES: begin() or load() gave a file, and `offset` in `packet` is not beyond what was written: bytes come in
  /// order, but may begin again at an earlier byte, which cuts the file there. Errors: cannot_write.
  import::ImportFailure write(std::uint32_t packet, std::uint64_t offset, proto::ByteView bytes);

  /// Any bytes of packets are in it.
  [[nodiscard]] bool worth_keeping() const { return fd_ >= 0 && !starts_.empty() && size_ > starts_.front(); }
  /// Removes the file, if this object has it open.
  void remove();

 private:
  import::ImportFailure open(int flags);
  import::ImportFailure cut(std::uint64_t size);
  void set_directory(const codec::Directory& directory, std::uint64_t directory_bytes);
  [[nodiscard]] import::ImportError error(import::ImportErrorCode code, const std::string& what) const;

  std::string path_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
  std::uint64_t bytes_lost_ = 0;
  std::vector<std::uint64_t> starts_;  ///< of each packet in the file
};

}  // namespace pmcd::tool
