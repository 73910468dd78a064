// SPDX-License-Identifier: MIT
// The frame reader: any cut of the stream gives the same frames, limits hold before memory is taken, errors stay.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <string>
#include <utility>
#include <vector>

#include "proto/frame.h"
#include "tests/proto/samples.h"

namespace pmcd::proto {
namespace {

using testing::from_hex;
using testing::to_hex;

struct Taken {
  std::vector<std::pair<std::uint16_t, std::string>> frames;
  ErrorCode error = ErrorCode::none;
  bool operator==(const Taken&) const = default;
};

Taken take_all(FrameReader& reader, ByteView bytes, std::size_t piece) {
  Taken out;
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    ByteView input = bytes.subspan(at, std::min(piece, bytes.size() - at));
    while (!input.empty()) {
      const auto frame = reader.next(input);
      if (!frame.ok()) {
        out.error = frame.error().code;
        return out;
      }
      if (frame->has_value()) out.frames.emplace_back((*frame)->type, to_hex((*frame)->body));
    }
  }
  return out;
}

TEST(FrameReader, EveryCutGivesTheSameFrames) {
  const Bytes stream = from_hex("02000000 0600  06000000 0400 01020304  03000000 ffff aa  02000000 0600");
  const std::vector<std::pair<std::uint16_t, std::string>> expected{
      {0x0006, ""}, {0x0004, "01 02 03 04"}, {0xffff, "aa"}, {0x0006, ""}};
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    FrameReader reader(kMaxClientFrame);
    const Taken taken = take_all(reader, stream, piece);
    EXPECT_EQ(taken.frames, expected) << "pieces of " << piece;
    EXPECT_EQ(taken.error, ErrorCode::none);
    EXPECT_FALSE(reader.mid_frame());
  }
}

TEST(FrameReader, EveryPrefixIsIncomplete) {
  const Bytes stream = from_hex("06000000 0400 01020304");
  for (std::size_t n = 0; n < stream.size(); ++n) {
    FrameReader reader(kMaxClientFrame);
    const Taken taken = take_all(reader, ByteView(stream).first(n), n + 1);
    EXPECT_TRUE(taken.frames.empty()) << n;
    EXPECT_EQ(taken.error, ErrorCode::none) << n;
    EXPECT_EQ(reader.mid_frame(), n > 0) << n;
  }
}

TEST(FrameReader, TheLongestFrameIsTakenAndOneByteMoreIsRefusedAtItsLength) {
  Bytes longest = make_frame(FrameType::ping, Bytes(kMaxClientFrame - kTypeBytes));
  FrameReader reader(kMaxClientFrame);
  EXPECT_EQ(take_all(reader, longest, 100).frames.size(), 1u);

  const Bytes too_long = from_hex("01100000");  // 4097, and nothing after it
  FrameReader other(kMaxClientFrame);
  EXPECT_EQ(take_all(other, too_long, 4).error, ErrorCode::frame_too_long);
  const Bytes good = from_hex("02000000 0600");
  EXPECT_EQ(take_all(other, good, 6).error, ErrorCode::frame_too_long) << "a broken stream stays broken";
}

TEST(FrameReader, AFrameWithoutATypeIsRefused) {
  for (const char* hex : {"00000000", "01000000"}) {
    FrameReader reader(kMaxClientFrame);
    EXPECT_EQ(take_all(reader, from_hex(hex), 1).error, ErrorCode::malformed) << hex;
  }
}

TEST(FrameReader, ABrowserIsRefused) {
  FrameReader reader(kMaxClientFrame);
  EXPECT_EQ(take_all(reader, as_bytes("GET / HTTP/1.1\r\n"), 16).error, ErrorCode::frame_too_long);
}

TEST(FrameReader, GarbageNeverTakesMoreThanTheLimit) {
  EXPECT_TRUE(rc::check("any bytes in any cut: frames within the limit or an error", [] {
    const auto raw = *rc::gen::container<std::vector<std::uint8_t>>(rc::gen::inRange<std::uint8_t>(0, 4));
    Bytes bytes;
    for (const std::uint8_t b : raw) bytes.push_back(static_cast<std::byte>(b));
    const auto piece = *rc::gen::inRange<std::size_t>(1, 20);
    FrameReader cut(64);
    FrameReader whole(64);
    const Taken a = take_all(cut, bytes, piece);
    const Taken b = take_all(whole, bytes, bytes.size() + 1);
    RC_ASSERT(a == b);
    for (const auto& [type, body] : a.frames) RC_ASSERT(body.size() <= 3 * 62);
  }));
}

TEST(ByteReader, NothingIsReadBeyondTheEnd) {
  const Bytes bytes = from_hex("0102030405");
  ByteReader reader(bytes);
  EXPECT_EQ(reader.u32(), 0x04030201u);
  EXPECT_EQ(reader.u16(), 0u);
  EXPECT_TRUE(reader.failed());
  EXPECT_EQ(reader.u8(), 0u) << "failed for good, although a byte is left";
  EXPECT_EQ(reader.left(), 1u);
  EXPECT_FALSE(reader.finished());
  EXPECT_TRUE(reader.rest().empty());
}

TEST(ByteReader, AStringLongerThanTheInputFails) {
  const Bytes bytes = from_hex("ff 61 62");
  ByteReader reader(bytes);
  EXPECT_EQ(reader.str8(), "");
  EXPECT_TRUE(reader.failed());
}

TEST(ByteWriter, LittleEndianOfEveryWidth) {
  ByteWriter writer;
  writer.u8(1);
  writer.u16(0x0203);
  writer.u32(0x04050607);
  writer.u64(0x08090a0b0c0d0e0f);
  writer.f64(-2.0);
  writer.str16("hi");
  EXPECT_EQ(to_hex(writer.take()), "01 03 02 07 06 05 04 0f 0e 0d 0c 0b 0a 09 08 00 00 00 00 00 00 00 c0 02 00 68 69");
}

}  // namespace
}  // namespace pmcd::proto
