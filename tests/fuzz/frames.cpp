// SPDX-License-Identifier: MIT
// The frame reader: one byte for the limit, a few for where the stream is cut, the rest is the stream. The same frames
// must come out of every cut, and they must be those that a reader of the whole stream, written here, finds.
#include <algorithm>
#include <optional>
#include <vector>

#include "proto/frame.h"
#include "tests/fuzz/check.h"
#include "tests/fuzz/script.h"

namespace pmcd::fuzz {
namespace {

struct Taken {
  std::uint16_t type = 0;
  proto::Bytes body;
  bool operator==(const Taken&) const = default;
};

struct Outcome {
  std::vector<Taken> frames;
  std::optional<proto::ErrorCode> error;
  proto::Bytes unfinished;  ///< if there is no error
  bool operator==(const Outcome&) const = default;
};

/// What must come out, read off the whole stream at once.
Outcome expected(Input stream, std::uint32_t limit) {
  Outcome out;
  while (true) {
    proto::ByteReader reader(stream);
    const std::uint32_t length = reader.u32();
    if (!reader.failed()) {
      if (length > limit) out.error = proto::ErrorCode::frame_too_long;
      if (length < proto::kTypeBytes) out.error = proto::ErrorCode::malformed;
      if (out.error) return out;
    }
    if (reader.failed() || reader.left() < length) {
      out.unfinished.assign(stream.begin(), stream.end());
      return out;
    }
    Taken taken;
    taken.type = reader.u16();
    const Input body = reader.bytes(length - proto::kTypeBytes);
    taken.body.assign(body.begin(), body.end());
    out.frames.push_back(std::move(taken));
    stream = reader.rest();
  }
}

/// The stream in pieces of the lengths that `cuts` names, over and over; 0 is an empty piece.
Outcome in_pieces(Input stream, std::uint32_t limit, Input cuts) {
  proto::FrameReader reader(limit);
  Outcome out;
  for (std::size_t i = 0; !stream.empty() && !out.error; ++i) {
    // An empty piece at each turn would never come to an end.
    const std::size_t cut = cuts.empty() ? stream.size() : std::to_integer<std::size_t>(cuts[i % cuts.size()]);
    const std::size_t size = std::min(stream.size(), i % 2 == 0 && !cuts.empty() ? cut : std::max<std::size_t>(cut, 1));
    proto::ByteView piece = stream.first(size);
    stream = stream.subspan(size);
    do {
      const std::size_t before = piece.size();
      const auto next = reader.next(piece);
      check(reader.unfinished().size() < limit + proto::kLengthBytes || limit < proto::kTypeBytes,
            "the reader holds a whole frame and does not give it out");
      check(reader.mid_frame() == !reader.unfinished().empty() || !next, "mid_frame and unfinished disagree");
      if (!next) {
        out.error = next.error().code;
        break;
      }
      if (!next.value()) {
        check(piece.empty(), "no frame although there is input left");
        break;
      }
      check(piece.size() < before, "a frame out of nothing");
      check(!reader.mid_frame(), "in the middle of a frame right after one");
      const proto::Frame& frame = *next.value();
      check(frame.body.size() + proto::kTypeBytes <= limit, "a frame that is longer than allowed");
      out.frames.push_back({frame.type, proto::Bytes(frame.body.begin(), frame.body.end())});
    } while (!piece.empty());
  }
  if (out.error) {
    const proto::Bytes more(16, std::byte{1});
    proto::ByteView view(more);
    const auto again = reader.next(view);
    check(!again && again.error().code == *out.error, "an error does not stick");
    return out;
  }
  const proto::ByteView unfinished = reader.unfinished();
  out.unfinished.assign(unfinished.begin(), unfinished.end());
  return out;
}

}  // namespace

void frames(Input input) {
  Script script(input);
  const std::uint8_t choice = script.u8();
  std::uint32_t limit = 0;
  switch (choice % 5) {
    case 0:
      limit = proto::kMaxClientFrame;
      break;
    case 1:
      limit = proto::kMaxAnswerFrame;
      break;
    case 2:
      limit = proto::kMaxAdminFrame;
      break;
    case 3:
      limit = 2u + choice;  // small ones, which short inputs reach
      break;
    default:
      limit = proto::kMaxDataFrame;
      break;
  }
  const Input cuts = script.bytes(script.below(8));
  const Input stream = script.rest();
  const Outcome wanted = expected(stream, limit);
  static constexpr std::array kOneByOne{std::byte{1}};
  check(in_pieces(stream, limit, {}) == wanted, "the whole stream gives other frames than it holds");
  check(in_pieces(stream, limit, cuts) == wanted, "a cut stream gives other frames");
  check(in_pieces(stream, limit, kOneByOne) == wanted, "a stream byte by byte gives other frames");
}

}  // namespace pmcd::fuzz
