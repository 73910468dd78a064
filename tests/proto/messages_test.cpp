// SPDX-License-Identifier: MIT
// Every message: golden bytes, every prefix refused, one byte more refused, round trips of random values, garbage.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <memory>
#include <set>

#include "proto/body.h"
#include "proto/mesh_list.h"
#include "proto/text.h"
#include "tests/proto/samples.h"

namespace pmcd::proto {
namespace {

using testing::all_samples;
using testing::body_of;
using testing::from_hex;
using testing::Sample;
using testing::text_bytes;
using testing::to_hex;

/// A copy on the heap of exactly its size, so that a read beyond it is seen by the sanitizer.
struct ExactCopy {
  explicit ExactCopy(ByteView from) : size(from.size()), bytes(new std::byte[from.size()]) {
    std::copy(from.begin(), from.end(), bytes.get());
  }
  [[nodiscard]] ByteView view() const { return {bytes.get(), size}; }
  std::size_t size;
  std::unique_ptr<std::byte[]> bytes;
};

TEST(Messages, GoldenBytes) {
  for (const Sample& s : all_samples()) EXPECT_EQ(to_hex(s.encoded), to_hex(from_hex(s.golden))) << s.name;
}

TEST(Messages, GoldenBytesComeBack) {
  for (const Sample& s : all_samples()) {
    const Bytes golden = from_hex(s.golden);
    const auto again = s.decode_and_encode(body_of(golden));
    ASSERT_TRUE(again.ok()) << s.name << ": " << again.error().detail;
    EXPECT_EQ(to_hex(*again), to_hex(golden)) << s.name;
  }
}

TEST(Messages, EveryTypeHasASample) {
  std::set<std::string> sampled;
  for (const Sample& s : all_samples()) sampled.insert(s.name);
  std::set<std::string> known;
  for (unsigned type = 0; type <= 0xffff; ++type) {
    if (const char* name = type_name(static_cast<std::uint16_t>(type))) known.insert(name);
  }
  EXPECT_EQ(sampled, known);
}

TEST(Messages, EveryPrefixIsRefused) {
  for (const Sample& s : all_samples()) {
    const ByteView body = body_of(s.encoded);
    // Messages that end with `rest` accept shorter bodies as long as the rest may be shorter: cut into the fields.
    const std::size_t rest = s.name == "mesh_opened" || s.name == "ingest_begin" ? 3 : 2;
    const bool open_end = s.rest_at_end || s.name == "chunk";
    const std::size_t shortest_good = s.name == "admin_answer" ? body.size() - 2 : body.size() - rest + 1;
    const std::size_t end = s.name == "chunk" ? body.size() - 2 : open_end ? shortest_good : body.size();
    for (std::size_t n = 0; n < end; ++n) {
      const ExactCopy prefix(body.first(n));
      const auto decoded = s.decode_and_encode(prefix.view());
      ASSERT_FALSE(decoded.ok()) << s.name << " cut to " << n;
      EXPECT_EQ(decoded.error().code, ErrorCode::malformed) << s.name << " cut to " << n;
    }
  }
}

TEST(Messages, OneByteMoreIsRefused) {
  for (const Sample& s : all_samples()) {
    if (s.rest_at_end) continue;
    Bytes longer(body_of(s.encoded).begin(), body_of(s.encoded).end());
    longer.push_back(std::byte{0});
    const ExactCopy copy(longer);
    const auto decoded = s.decode_and_encode(copy.view());
    ASSERT_FALSE(decoded.ok()) << s.name;
    EXPECT_EQ(decoded.error().code, ErrorCode::malformed) << s.name;
  }
}

TEST(Messages, ALaterMinorMayAddFieldsToTheVersionedOnes) {
  for (const Sample& s : all_samples()) {
    const bool versioned = s.name == "hello" || s.name == "hello_ok" || s.name == "join" || s.name == "join_ok" ||
                           s.name == "admin_hello" || s.name == "admin_hello_ok";
    if (!versioned) continue;
    Bytes body(body_of(s.encoded).begin(), body_of(s.encoded).end());
    body[6] = std::byte{1};  // minor 1
    body.push_back(std::byte{42});
    EXPECT_TRUE(s.decode_and_encode(body).ok()) << s.name;
    body[4] = std::byte{2};  // major 2
    const auto other_major = s.decode_and_encode(body);
    ASSERT_FALSE(other_major.ok()) << s.name;
    EXPECT_EQ(other_major.error().code, ErrorCode::unsupported_version) << s.name;
    const auto only_version = s.decode_and_encode(ByteView(body).first(8));
    ASSERT_FALSE(only_version.ok()) << s.name;
    EXPECT_EQ(only_version.error().code, ErrorCode::unsupported_version) << s.name << ": version is judged first";
    body[0] = std::byte{'X'};
    const auto other_magic = s.decode_and_encode(body);
    ASSERT_FALSE(other_magic.ok()) << s.name;
    EXPECT_EQ(other_magic.error().code, ErrorCode::bad_magic) << s.name;
  }
}

TEST(Messages, GarbageIsRefusedOrComesBackTheSame) {
  const std::vector<Sample> samples = all_samples();
  EXPECT_TRUE(rc::check("a decoder accepts only what its encoder would write", [&] {
    const auto& s = samples[*rc::gen::inRange<std::size_t>(0, samples.size())];
    const auto raw = *rc::gen::container<std::vector<std::uint8_t>>(rc::gen::arbitrary<std::uint8_t>());
    Bytes body;
    for (const std::uint8_t b : raw) body.push_back(static_cast<std::byte>(b));
    const ExactCopy copy(body);
    const auto again = s.decode_and_encode(copy.view());
    if (again.ok() && s.name.find("hello") == std::string::npos && s.name.find("join") == std::string::npos) {
      RC_ASSERT(to_hex(body_of(*again)) == to_hex(body));
    }
  }));
}

TEST(Messages, AFlippedBitIsRefusedOrComesBackTheSame) {
  for (const Sample& s : all_samples()) {
    const Bytes body(body_of(s.encoded).begin(), body_of(s.encoded).end());
    for (std::size_t bit = 0; bit < body.size() * 8; ++bit) {
      Bytes flipped = body;
      flipped[bit / 8] ^= static_cast<std::byte>(1u << (bit % 8));
      const ExactCopy copy(flipped);
      const auto again = s.decode_and_encode(copy.view());
      if (!again.ok()) continue;
      EXPECT_EQ(to_hex(body_of(*again)), to_hex(flipped)) << s.name << " bit " << bit;
    }
  }
}

TEST(Messages, RandomRequestsRoundTrip) {
  EXPECT_TRUE(rc::check("get_next_packet, mesh_opened, chunk, transfer_end, error", [] {
    const auto id = *rc::gen::inRange<std::uint32_t>(1, 0xffffffff);
    const auto handle = *rc::gen::inRange<std::uint32_t>(1, 0xffffffff);
    const GetNextPacket next{id, handle};
    RC_ASSERT(decode<GetNextPacket>(body_of(encode(next))).value() == next);

    const auto directory_size = *rc::gen::inRange<std::size_t>(1, 3000);
    const MeshOpened opened{id, handle, *rc::gen::arbitrary<std::uint64_t>(), Bytes(directory_size, std::byte{7})};
    RC_ASSERT(decode<MeshOpened>(body_of(encode(opened))).value() == opened);

    const auto size = *rc::gen::inRange<std::uint32_t>(1, 2000);
    const auto offset = *rc::gen::inRange<std::uint64_t>(0, std::uint64_t{1} << 62);
    const ChunkHeader header{id, handle, *rc::gen::arbitrary<std::uint32_t>(), offset,
                             offset + size + *rc::gen::inRange<std::uint64_t>(0, std::uint64_t{1} << 62)};
    const Bytes frame = testing::chunk_frame(header, Bytes(size, std::byte{9}));
    const auto chunk = decode_chunk(body_of(frame));
    RC_ASSERT(chunk.ok());
    RC_ASSERT(chunk->header == header);
    RC_ASSERT(chunk->bytes.size() == size);

    const ErrorMessage error{id, static_cast<ErrorCode>(*rc::gen::inRange<std::uint16_t>(1, 0xffff)),
                             printable(*rc::gen::string<std::string>(), kMaxErrorTextBytes)};
    RC_ASSERT(decode<ErrorMessage>(body_of(encode(error))).value() == error);
  }));
}

ErrorCode code_of(const Result<ChunkView>& result) {
  return result.ok() ? ErrorCode::none : result.error().code;
}

TEST(Messages, ChunksMustFitTheirTotal) {
  const auto body = [](std::uint64_t offset, std::uint64_t total, std::size_t size) {
    const Bytes frame = testing::chunk_frame({1, 1, 0, offset, total}, Bytes(size, std::byte{1}));
    return Bytes(body_of(frame).begin(), body_of(frame).end());
  };
  EXPECT_EQ(code_of(decode_chunk(body(0, 10, 10))), ErrorCode::none);
  EXPECT_EQ(code_of(decode_chunk(body(1, 10, 10))), ErrorCode::malformed);
  EXPECT_EQ(code_of(decode_chunk(body(11, 10, 1))), ErrorCode::malformed);
  EXPECT_EQ(code_of(decode_chunk(body(~std::uint64_t{0}, ~std::uint64_t{0}, 2))), ErrorCode::malformed);
  EXPECT_EQ(code_of(decode_chunk(body(0, 10, 0))), ErrorCode::malformed);
  EXPECT_EQ(code_of(decode_chunk(body(0, kMaxChunkBytes, kMaxChunkBytes))), ErrorCode::none);
  EXPECT_EQ(code_of(decode_chunk(body(0, kMaxChunkBytes + 1, kMaxChunkBytes + 1))), ErrorCode::malformed);
}

TEST(Messages, RefusesWhatHasTheFormButNotTheMeaning) {
  EXPECT_FALSE(decode<GetMeshList>(body_of(encode(GetMeshList{0}))).ok()) << "id 0";
  EXPECT_FALSE(decode<GetBaseMesh>(body_of(encode(GetBaseMesh{0, "a"}))).ok()) << "id 0";
  EXPECT_FALSE(decode<MeshOpened>(body_of(encode(MeshOpened{1, 0, 1, text_bytes("d")}))).ok()) << "handle 0";
  EXPECT_FALSE(decode<MeshOpened>(body_of(encode(MeshOpened{1, 1, 1, {}}))).ok()) << "no directory";
  EXPECT_FALSE(decode<MeshOpened>(body_of(encode(MeshOpened{1, 1, 1, Bytes(kMaxDirectoryBytes + 1)}))).ok());
  EXPECT_TRUE(decode<MeshOpened>(body_of(encode(MeshOpened{1, 1, 1, Bytes(kMaxDirectoryBytes)}))).ok());
  EXPECT_FALSE(decode<TransferEnd>(from_hex("01000000 04 0000")).ok()) << "no such result";
  EXPECT_FALSE(decode<TransferEnd>(from_hex("01000000 00 4000")).ok()) << "complete with a code";
  EXPECT_FALSE(decode<TransferEnd>(from_hex("01000000 02 0000")).ok()) << "failed without one";
  EXPECT_FALSE(decode<ErrorMessage>(from_hex("01000000 0000 0000")).ok()) << "error without a code";
  EXPECT_FALSE(decode<ErrorMessage>(from_hex("01000000 2300 0100 1b")).ok()) << "escape in a text";
  EXPECT_TRUE(decode<ErrorMessage>(from_hex("01000000 ff7f 0000")).ok()) << "a code of a later version";
  EXPECT_FALSE(decode<Hello>(from_hex("504d4344 0100 0000 01 0a")).ok()) << "line end in the agent's name";
  EXPECT_FALSE(decode<IngestOk>(from_hex("01000000 0000000000000000 02")).ok());
  EXPECT_FALSE(decode<IngestBegin>(from_hex("01000000 02 01 61 00")).ok()) << "unknown flag";
  EXPECT_FALSE(decode<AdminAnswer>(from_hex("01000000 02")).ok());
}

TEST(Messages, EncodersMakeTextsFit) {
  const ErrorMessage error{1, ErrorCode::storage_failed, "disk \x1b[31mfull\n" + std::string(1000, 'x')};
  const auto decoded = decode<ErrorMessage>(body_of(encode(error)));
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->text.substr(0, 15), "disk ?[31mfull?");
  EXPECT_EQ(decoded->text.size(), kMaxErrorTextBytes);
  const auto hello = decode<Hello>(body_of(encode(Hello{{1, 0}, std::string(63, 'a') + "\xc3\xa9"})));
  ASSERT_TRUE(hello.ok());
  EXPECT_EQ(hello->agent, std::string(63, 'a')) << "cut between characters";
}

TEST(Messages, AnswersAreSplitAndMarked) {
  const std::string json(kMaxChunkBytes + 10, 'j');
  const std::vector<Bytes> frames = encode_answer(9, json);
  ASSERT_EQ(frames.size(), 2u);
  const auto first = decode<AdminAnswer>(body_of(frames[0]));
  const auto second = decode<AdminAnswer>(body_of(frames[1]));
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_FALSE(first->last);
  EXPECT_TRUE(second->last);
  EXPECT_EQ(first->text + second->text, json);
  EXPECT_EQ(encode_answer(9, "").size(), 1u);
  EXPECT_EQ(encode_answer(9, std::string(kMaxChunkBytes, 'j')).size(), 1u);
}

TEST(Messages, IdsOfUnreadableFrames) {
  EXPECT_EQ(peek_id(from_hex("0a000000 ff")), 10u);
  EXPECT_EQ(peek_id(from_hex("0a0000")), 0u);
}

}  // namespace
}  // namespace pmcd::proto
