// SPDX-License-Identifier: MIT
// Little-endian fields in byte buffers. The reader has one mover and it is checked: past the end it yields zeros and
// remembers that it failed. No varints, no ownership.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace pmcd::codec {

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  /// The next unsigned integer; 0 and !ok() when fewer bytes are left.
  template <typename T>
  T read() {
    static_assert(std::is_unsigned_v<T>);
    T value = 0;
    if (bytes_.size() - position_ < sizeof(T)) {
      ok_ = false;
      position_ = bytes_.size();
      return value;
    }
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value = static_cast<T>(value | (static_cast<T>(bytes_[position_ + i]) << (8 * i)));
    }
    position_ += sizeof(T);
    return value;
  }
  double read_double() { return std::bit_cast<double>(read<std::uint64_t>()); }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename T>
  void write(T value) {
    static_assert(std::is_unsigned_v<T>);
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFF));
  }
  void write_double(double value) { write(std::bit_cast<std::uint64_t>(value)); }

 private:
  std::vector<std::byte>& bytes_;
};

}  // namespace pmcd::codec
