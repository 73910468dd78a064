// SPDX-License-Identifier: MIT
// The data channel taken apart where it lies in the receive buffer: chunk payloads are handed on in pieces and never
// copied, so that the load costs the client's core as little as possible. It does not know which chunk is expected.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "proto/frame.h"
#include "proto/messages.h"

namespace pmcd::bench {

class DataStream {
 public:
  /// Calls, in the order of the stream, `on_piece(const proto::ChunkHeader&, proto::ByteView)` for each run of payload
  /// bytes, with the header's offset moved to the first of them, and `on_frame(const proto::Frame&)` for every other
  /// frame. What is no frame, or too long for this channel, ends the program.
  template <typename OnPiece, typename OnFrame>
  void feed(proto::ByteView input, OnPiece&& on_piece, OnFrame&& on_frame) {
    while (!input.empty()) {
      if (payload_left_ > 0) {
        const proto::ByteView piece = input.first(std::min(payload_left_, input.size()));
        on_piece(static_cast<const proto::ChunkHeader&>(chunk_), piece);
        chunk_.offset += piece.size();
        payload_left_ -= piece.size();
        input = input.subspan(piece.size());
      } else if (const auto frame = gather(input)) {
        on_frame(*frame);
      }
    }
  }

 private:
  /// Takes bytes of a frame's head (of the whole frame if it is no chunk). Gives a frame that is no chunk once it is
  /// whole; a chunk's head sets chunk_ and payload_left_.
  std::optional<proto::Frame> gather(proto::ByteView& input);
  bool hold(proto::ByteView& input, std::size_t wanted);

  std::array<std::byte, 1024> held_{};  ///< of a frame whose head is not whole yet
  std::size_t held_bytes_ = 0;
  proto::ChunkHeader chunk_;
  std::size_t payload_left_ = 0;
};

}  // namespace pmcd::bench
