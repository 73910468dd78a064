// SPDX-License-Identifier: MIT
// One cursor to read and one buffer to write, little endian. The reader has no mover that is not checked: a read beyond
// the end gives zero and marks the reader failed for good, so a decoder may read all its fields and ask once.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace pmcd::proto {

using Bytes = std::vector<std::byte>;
using ByteView = std::span<const std::byte>;

class ByteReader {
 public:
  explicit ByteReader(ByteView bytes) : bytes_(bytes) {}

  std::uint8_t u8();
  std::uint16_t u16();
  std::uint32_t u32();
  std::uint64_t u64();
  double f64();  ///< IEEE 754 bits of a u64; NaN and infinities come through

  /// `count` bytes, pointing into the input; empty and failed when there are fewer.
  ByteView bytes(std::size_t count);
  /// All that is left; never fails.
  ByteView rest();
  template <std::size_t N>
  std::array<std::byte, N> array() {
    std::array<std::byte, N> out{};
    const ByteView from = bytes(N);
    for (std::size_t i = 0; i < from.size(); ++i) out[i] = from[i];
    return out;
  }
  /// u8 length, then that many bytes. The text is not checked, see text.h.
  std::string str8();
  /// u16 length, then that many bytes.
  std::string str16();

  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - position_; }
  /// Nothing failed and nothing is left over.
  [[nodiscard]] bool finished() const { return !failed_ && left() == 0; }

 private:
  std::uint64_t little_endian(std::size_t width);

  ByteView bytes_;
  std::size_t position_ = 0;
  bool failed_ = false;
};

class ByteWriter {
 public:
  void u8(std::uint8_t value) { little_endian(value, 1); }
  void u16(std::uint16_t value) { little_endian(value, 2); }
  void u32(std::uint32_t value) { little_endian(value, 4); }
  void u64(std::uint64_t value) { little_endian(value, 8); }
  void f64(double value);
  void bytes(ByteView value);
  /// REQUIRES: at most 255 bytes; what is longer is cut.
  void str8(std::string_view value);
  /// REQUIRES: at most 65535 bytes; what is longer is cut.
  void str16(std::string_view value);
  void reserve(std::size_t size) { out_.reserve(size); }

  [[nodiscard]] std::size_t size() const { return out_.size(); }
  /// Gives the buffer away and leaves the writer empty.
  Bytes take() { return std::move(out_); }

 private:
  void little_endian(std::uint64_t value, std::size_t width);

  Bytes out_;
};

/// The bytes of a text, without copying.
ByteView as_bytes(std::string_view text);

}  // namespace pmcd::proto
