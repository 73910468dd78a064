// SPDX-License-Identifier: MIT
// Little-endian fields and varints in byte buffers. The reader's movers are checked: past the end it yields zeros and
// remembers that it failed; a varint that is not in its one form is remembered with its place. No ownership.
#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace pmcd::codec {

/// A varint is LEB128: seven bits a byte, the lowest first, the top bit set in all bytes but the last. It has its
/// shortest form, and at most this many bytes where nothing else is said.
inline constexpr std::size_t kMostVarintBytes = 5;
inline constexpr std::uint64_t kMostVarint = (std::uint64_t{1} << (7 * kMostVarintBytes)) - 1;

/// Signed numbers as unsigned ones, small magnitudes first: 0, -1, 1, -2, 2 become 0, 1, 2, 3, 4.
constexpr std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ (value < 0 ? ~std::uint64_t{0} : 0);
}
constexpr std::int64_t unzigzag(std::uint64_t value) {
  return static_cast<std::int64_t>((value >> 1) ^ ((value & 1) != 0 ? ~std::uint64_t{0} : 0));
}

inline bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}
/// The nearest float32. REQUIRES: within float32's range. Not inlined for the reason that lattice.cpp gives.
[[gnu::noinline]] inline double through_float32(double value) {
  return static_cast<double>(static_cast<float>(value));
}
/// Whether a float32 is this very value, its sign included; not for infinities and NaN.
inline bool is_float32(double value) {
  return std::abs(value) <= std::numeric_limits<float>::max() && same_bits(through_float32(value), value);
}

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
  /// A float32's value.
  double read_float() { return static_cast<double>(std::bit_cast<float>(read<std::uint32_t>())); }

  /// The next varint; 0 and !ok() when it is cut off, has more bytes than its value needs, or a value above `most`,
  /// as soon as that shows. REQUIRES: most < 2^63.
  std::uint64_t read_varint(std::uint64_t most = kMostVarint) {
    const std::size_t start = position_;
    std::uint64_t value = 0;
    for (unsigned i = 0; i < kMostVarintBytes || (most >> (7 * i)) != 0; ++i) {
      const auto byte = read<std::uint8_t>();
      if (!ok_) return 0;
      value |= std::uint64_t{byte & 0x7Fu} << (7 * i);
      if (byte >= 0x80) continue;
      if ((byte == 0 && i > 0) || value > most) break;
      return value;
    }
    ok_ = false;
    if (!malformed_at_) malformed_at_ = start;
    position_ = bytes_.size();
    return 0;
  }

  /// REQUIRES: `count` bytes are left.
  void skip(std::size_t count) { position_ += count; }

  /// False: the bytes ended too early, or malformed_at() says where a varint is not what it must be.
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::optional<std::size_t> malformed_at() const { return malformed_at_; }
  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  std::optional<std::size_t> malformed_at_;
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
  /// The nearest float32.
  void write_float(double value) { write(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  /// REQUIRES: value <= the most that is read.
  void write_varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<std::byte>(value | 0x80));
    bytes_.push_back(static_cast<std::byte>(value));
  }

 private:
  std::vector<std::byte>& bytes_;
};

}  // namespace pmcd::codec
