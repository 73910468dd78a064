// SPDX-License-Identifier: MIT
// One sample of every message with its exact frame, and the worked example of docs/PROTOCOL.md. Shared by the tests of
// proto; the hex is written by hand from the document's tables, not taken from the encoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/admin.h"
#include "proto/admin_rules.h"
#include "proto/frame.h"
#include "proto/messages.h"

namespace pmcd::proto::testing {

/// "0a 0b" to bytes; blanks and line ends are skipped.
inline Bytes from_hex(std::string_view hex) {
  Bytes out;
  int high = -1;
  for (const char c : hex) {
    const std::string_view digits = "0123456789abcdef";
    const std::size_t digit = digits.find(c);
    if (digit == std::string_view::npos) continue;
    if (high < 0) {
      high = static_cast<int>(digit);
    } else {
      out.push_back(static_cast<std::byte>(high * 16 + static_cast<int>(digit)));
      high = -1;
    }
  }
  return out;
}

inline std::string to_hex(ByteView bytes) {
  std::string out;
  for (const std::byte b : bytes) {
    const char* digits = "0123456789abcdef";
    if (!out.empty()) out += ' ';
    out += digits[std::to_integer<unsigned>(b) >> 4];
    out += digits[std::to_integer<unsigned>(b) & 15];
  }
  return out;
}

inline ByteView body_of(const Bytes& frame) {
  return ByteView(frame).subspan(kFrameHeaderBytes);
}

inline Bytes text_bytes(std::string_view text) {
  const ByteView view = as_bytes(text);
  return {view.begin(), view.end()};
}

inline Token counting_token() {
  Token token{};
  for (std::size_t i = 0; i < token.size(); ++i) token[i] = static_cast<std::byte>(i);
  return token;
}

/// A message, its frame, and its decoder as a function that tells whether a body is accepted and gives the same frame
/// back when it is encoded again.
struct Sample {
  std::string name;
  Bytes encoded;
  std::string golden;
  std::function<Result<Bytes>(ByteView body)> decode_and_encode;
  bool rest_at_end = false;  ///< a byte more is a longer rest, not an error
};

template <typename M>
Sample sample(const M& message, std::string golden, bool rest_at_end = false) {
  return {type_name(static_cast<std::uint16_t>(M::kType)), encode(message), std::move(golden),
          [](ByteView body) -> Result<Bytes> {
            const auto decoded = decode<M>(body);
            if (!decoded) return decoded.error();
            return encode(*decoded);
          },
          rest_at_end};
}

inline Bytes chunk_frame(const ChunkHeader& header, ByteView payload) {
  const auto head = encode_chunk_header(header, static_cast<std::uint32_t>(payload.size()));
  Bytes frame(head.begin(), head.end());
  frame.insert(frame.end(), payload.begin(), payload.end());
  return frame;
}

inline Bytes ingest_data_frame(const IngestDataHeader& header, ByteView payload) {
  const auto head = encode_ingest_data_header(header, static_cast<std::uint32_t>(payload.size()));
  Bytes frame(head.begin(), head.end());
  frame.insert(frame.end(), payload.begin(), payload.end());
  return frame;
}

std::vector<Sample> all_samples();

}  // namespace pmcd::proto::testing
