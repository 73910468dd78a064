// SPDX-License-Identifier: MIT
// The checks of one transfer.
#include "client/transfer.h"

#include <string>

namespace pmcd::client {

namespace {

Error violation(const std::string& what) {
  return {Failure::violation, proto::ErrorCode::none, "the server broke the protocol: " + what};
}

}  // namespace

std::optional<Error> Transfer::check_expected() const {
  if (!expected_ || !started()) return std::nullopt;
  if (handle_ != expected_->handle) return violation("a chunk names another mesh than the one asked for");
  if (packet_ != expected_->packet) {
    return violation("packet " + std::to_string(packet_) + " came instead of " + std::to_string(expected_->packet));
  }
  if (expected_->total && total_ != *expected_->total) {
    return violation("packet " + std::to_string(packet_) + " has " + std::to_string(total_) +
                     " bytes, its directory says " + std::to_string(*expected_->total));
  }
  return std::nullopt;
}

std::optional<Error> Transfer::expect(std::uint32_t handle, std::uint32_t packet, std::optional<std::uint64_t> total) {
  expected_ = Expected{handle, packet, total};
  return check_expected();
}

std::optional<Error> Transfer::take(const proto::ChunkView& chunk) {
  if (ended()) return violation("a chunk came behind the end of its transfer");
  const proto::ChunkHeader& header = chunk.header;
  if (!started()) {
    if (header.total > max_bytes_) {
      return Error{Failure::limit_exceeded, proto::ErrorCode::none,
                   "the server wants to send " + std::to_string(header.total) + " bytes at once, this client takes " +
                       std::to_string(max_bytes_)};
    }
    handle_ = header.handle;
    packet_ = header.packet;
    total_ = header.total;
  } else if (header.handle != handle_ || header.packet != packet_ || header.total != total_) {
    return violation("the chunks of a transfer do not agree on what they are of");
  }
  if (header.offset != received_) {
    return violation("a chunk begins at byte " + std::to_string(header.offset) + ", expected was " +
                     std::to_string(received_));
  }
  started_ = true;
  received_ += chunk.bytes.size();
  if (!discarded_) bytes_.insert(bytes_.end(), chunk.bytes.begin(), chunk.bytes.end());
  return check_expected();
}

std::optional<Error> Transfer::finish(const proto::TransferEnd& end) {
  if (ended()) return violation("a transfer ended twice");
  if (end.result == proto::TransferResult::complete && (!started() || received_ != total_)) {
    return violation("a transfer ended as complete after " + std::to_string(received_) + " of " +
                     std::to_string(total_) + " bytes");
  }
  if (end.result == proto::TransferResult::end_of_mesh && started()) {
    return violation("a transfer with chunks ended as end_of_mesh");
  }
  end_ = end;
  return std::nullopt;
}

void Transfer::discard() {
  discarded_ = true;
  bytes_ = {};
}

}  // namespace pmcd::client
