// SPDX-License-Identifier: MIT
// One request on its way: collects the bytes of its chunks and checks that they come in order, without gaps and within
// what was allowed. Knows no socket.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "client/result.h"
#include "proto/messages.h"

namespace pmcd::client {

class Transfer {
 public:
  /// `max_bytes`: the largest total that is accepted. `begun`: the bytes that are there already, the chunks follow
  /// them.
  Transfer(std::uint32_t id, std::uint64_t max_bytes, proto::Bytes begun = {})
      : id_(id), max_bytes_(max_bytes), begun_(begun.size()), received_(begun.size()), bytes_(std::move(begun)) {}

  /// Says beforehand what the chunks must name. A base mesh learns its handle only when the server opens it, which may
  /// be after its first chunk: then this checks what has come. An error if it does not fit.
  std::optional<Error> expect(std::uint32_t handle, std::uint32_t packet, std::optional<std::uint64_t> total);

  /// Takes the next chunk. Memory grows with the bytes that came, not with the total that a chunk claims.
  /// Errors: violation, limit_exceeded.
  std::optional<Error> take(const proto::ChunkView& chunk);

  /// Takes the end. Errors: violation (a complete transfer that is not, chunks before end_of_mesh).
  std::optional<Error> finish(const proto::TransferEnd& end);

  /// Lets the bytes go, now and when more come; everything is still checked.
  void discard();

  [[nodiscard]] std::uint32_t id() const { return id_; }
  [[nodiscard]] bool started() const { return started_; }  ///< a chunk has come
  [[nodiscard]] bool ended() const { return end_.has_value(); }
  [[nodiscard]] bool discarded() const { return discarded_; }
  [[nodiscard]] std::uint64_t begun() const { return begun_; }        ///< bytes that were there before the first chunk
  [[nodiscard]] std::uint64_t received() const { return received_; }  ///< the begun bytes included
  [[nodiscard]] std::uint64_t total() const { return total_; }        ///< 0 before the first chunk
  /// REQUIRES: ended().
  [[nodiscard]] const proto::TransferEnd& end() const { return *end_; }
  [[nodiscard]] proto::ByteView bytes() const { return bytes_; }
  proto::Bytes take_bytes() { return std::move(bytes_); }

 private:
  struct Expected {
    std::uint32_t handle = 0;
    std::uint32_t packet = 0;
    std::optional<std::uint64_t> total;
  };
  [[nodiscard]] std::optional<Error> check_expected() const;

  std::uint32_t id_;
  std::uint64_t max_bytes_;
  std::optional<Expected> expected_;
  std::uint32_t handle_ = 0;
  std::uint32_t packet_ = 0;
  std::uint64_t total_ = 0;
  std::uint64_t begun_;
  std::uint64_t received_;
  bool started_ = false;
  bool discarded_ = false;
  proto::Bytes bytes_;
  std::optional<proto::TransferEnd> end_;
};

}  // namespace pmcd::client
