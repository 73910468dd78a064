// SPDX-License-Identifier: MIT
// Texts, the mesh list, codes, and the rules of a session.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <limits>
#include <string>
#include <vector>

#include "proto/mesh_list.h"
#include "proto/session.h"
#include "proto/text.h"
#include "tests/proto/samples.h"

namespace pmcd::proto {
namespace {

TEST(Text, MeshNames) {
  for (const char* good : {"bunny", "a", "Stanford bunny", "b\xc3\xbcste", "\xe5\x85\x94", "\xf0\x9f\x90\xb0",
                           ".hidden", "a.b\\c", "..."}) {
    EXPECT_TRUE(is_mesh_name(good)) << good;
  }
  for (const char* bad : {
           "",
           ".",
           "..",
           "a/b",
           "/",
           " a",
           "a ",
           "a\nb",
           "a\tb",
           "\x7f",
           "\x1b[31m",
           "\u0085",           // C1
           "\u202eevil",       // right-to-left override
           "\u2028",           // line separator
           "\ufeffa",          // byte-order mark
           "\xff",             // no lead byte
           "\xc3",             // cut short
           "\xc0\xaf",         // overlong slash
           "\xe0\x80\xaf",     // overlong slash
           "\xed\xa0\x80",     // surrogate
           "\xf4\x90\x80\x80"  // above U+10FFFF
       }) {
    EXPECT_FALSE(is_mesh_name(bad)) << bad;
  }
  EXPECT_FALSE(is_mesh_name(std::string_view("a\0b", 3)));
  EXPECT_TRUE(is_mesh_name(std::string(128, 'x')));
  EXPECT_FALSE(is_mesh_name(std::string(129, 'x')));
}

TEST(Text, PrintableAlwaysGivesPrintable) {
  EXPECT_TRUE(rc::check("any bytes become printable UTF-8 within the limit", [] {
    const auto text = *rc::gen::container<std::string>(rc::gen::arbitrary<char>());
    const auto limit = *rc::gen::inRange<std::size_t>(0, 50);
    const std::string out = printable(text, limit);
    RC_ASSERT(is_printable_utf8(out));
    RC_ASSERT(out.size() <= limit);
    if (is_printable_utf8(text) && text.size() <= limit) RC_ASSERT(out == text);
  }));
}

MeshListEntry entry(std::string name) {
  MeshListEntry out;
  out.name = std::move(name);
  out.generation = 0x0123456789abcdef;
  out.vertices = 100;
  out.faces = 196;
  out.levels = 9;
  out.bytes = 5000;
  out.lossless = true;
  out.bits = 12;
  out.box_min = {-1, -2, -3};
  out.box_max = {1, 2, 3.5};
  return out;
}

MeshPage page(std::vector<MeshListEntry> entries, std::uint32_t remaining = 0) {
  const auto matches = static_cast<std::uint32_t>(entries.size()) + remaining;
  return {matches, remaining, std::move(entries)};
}

TEST(MeshList, GoldenBytes) {
  MeshListEntry one = entry("bunny");
  one.float64 = true;
  EXPECT_EQ(
      testing::to_hex(encode_mesh_page({9, 3, {one}})),
      testing::to_hex(testing::from_hex(
          "09000000 03000000 01000000 05 62756e6e79 efcdab8967452301 64000000 c4000000 09000000 8813000000000000 03 0c "
          "00"
          "000000000000f0bf 00000000000000c0 00000000000008c0 000000000000f03f 0000000000000040 0000000000000c40")));
  EXPECT_EQ(testing::to_hex(encode_mesh_page({})), "00 00 00 00 00 00 00 00 00 00 00 00");
}

TEST(MeshList, RoundTrip) {
  const MeshPage whole = page({entry("a"), entry("b"), entry("b\xc3\xbcste")}, 7);
  const auto decoded = decode_mesh_page(encode_mesh_page(whole));
  ASSERT_TRUE(decoded.ok()) << decoded.error().detail;
  EXPECT_EQ(*decoded, whole);
  EXPECT_EQ(*decode_mesh_page(encode_mesh_page({})), MeshPage{});
}

TEST(MeshList, EveryPrefixAndOneByteMoreAreRefused) {
  Bytes bytes = encode_mesh_page(page({entry("a"), entry("b")}));
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const auto decoded = decode_mesh_page(ByteView(bytes).first(n));
    ASSERT_FALSE(decoded.ok()) << n;
    EXPECT_EQ(decoded.error().code, ErrorCode::malformed);
  }
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(decode_mesh_page(bytes).ok());
}

TEST(MeshList, RefusesCountsThatCannotBe) {
  const auto decoded = decode_mesh_page(testing::from_hex("ffffffff 00000000 ffffffff"));
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().where, 8u) << "more than the bytes can hold";
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page({0, 0, {entry("a")}})).ok()) << "fewer matches than entries";
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page({3, 3, {entry("a")}})).ok()) << "more remaining than matches";
  std::vector<MeshListEntry> many;
  for (std::uint32_t i = 0; i <= kMaxPageEntries; ++i) many.push_back(entry("n" + std::to_string(100'000 + i)));
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page(page(many))).ok()) << "one entry too many";
  many.pop_back();
  EXPECT_TRUE(decode_mesh_page(encode_mesh_page(page(many))).ok());
}

TEST(MeshList, AFullPageOfTheLongestNamesIsWithinTheLimit) {
  std::vector<MeshListEntry> many;
  for (std::uint32_t i = 0; i < kMaxPageEntries; ++i) {
    many.push_back(entry(std::to_string(1000 + i) + std::string(kMaxNameBytes - 4, 'x')));
  }
  EXPECT_LE(encode_mesh_page(page(many)).size(), kMaxMeshPageBytes);
}

TEST(MeshList, RefusesEntriesThatMakeNoSense) {
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page(page({entry("b"), entry("a")}))).ok()) << "order";
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page(page({entry("a"), entry("a")}))).ok()) << "twice";
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page(page({entry("a/b")}))).ok()) << "name";
  MeshListEntry infinite = entry("a");
  infinite.box_max[2] = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(decode_mesh_page(encode_mesh_page(page({infinite}))).ok()) << "box";
  Bytes flags = encode_mesh_page(page({entry("a")}));
  flags[12 + 2 + 28] |= std::byte{4};
  EXPECT_FALSE(decode_mesh_page(flags).ok()) << "flags";
}

TEST(MeshList, FilterComparesAsciiWithoutCase) {
  EXPECT_TRUE(matches_filter("Stanford Bunny", ""));
  EXPECT_TRUE(matches_filter("Stanford Bunny", "bunny"));
  EXPECT_TRUE(matches_filter("Stanford Bunny", "D bU"));
  EXPECT_FALSE(matches_filter("Stanford Bunny", "bunnyx"));
  EXPECT_FALSE(matches_filter("bunny", "b.nny")) << "no pattern";
  EXPECT_TRUE(matches_filter("B\xc3\xbcste", "b\xc3\xbc"));
  EXPECT_FALSE(matches_filter("B\xc3\xbcste", "b\xc3\x9c")) << "only ASCII letters have no case";
  EXPECT_FALSE(matches_filter("[", "{")) << "only letters";
}

TEST(Codes, NumbersSayWhatTheyEnd) {
  for (const CodeInfo& info : all_codes()) {
    EXPECT_EQ(code_ends(info.code), info.ends) << info.name;
    EXPECT_EQ(find_code(static_cast<std::uint16_t>(info.code)), &info);
    EXPECT_EQ(code_name(info.code), info.name);
  }
  EXPECT_EQ(find_code(0), nullptr);
  EXPECT_EQ(code_name(ErrorCode::none), "none");
  EXPECT_EQ(code_name(static_cast<ErrorCode>(63)), "unknown_code");
  EXPECT_EQ(code_ends(static_cast<ErrorCode>(63)), Ends::request) << "by range";
  EXPECT_EQ(code_ends(static_cast<ErrorCode>(95)), Ends::mesh);
  EXPECT_EQ(code_ends(static_cast<ErrorCode>(159)), Ends::request);
  EXPECT_EQ(code_ends(static_cast<ErrorCode>(31)), Ends::session);
  EXPECT_EQ(code_ends(static_cast<ErrorCode>(40000)), Ends::session);
}

ErrorCode check(Channel channel, SessionState state, FrameType type) {
  return check_client_frame(channel, state, static_cast<std::uint16_t>(type));
}

TEST(Session, OneFirstFramePerChannel) {
  using enum SessionState;
  for (unsigned type = 0; type < 0x200; ++type) {
    const auto number = static_cast<std::uint16_t>(type);
    const auto is = [&](FrameType t) { return number == static_cast<std::uint16_t>(t); };
    const auto expected = [&](FrameType t) { return is(t) ? ErrorCode::none : ErrorCode::wrong_state; };
    EXPECT_EQ(check_client_frame(Channel::request, fresh, number), expected(FrameType::hello)) << type;
    EXPECT_EQ(check_client_frame(Channel::data, fresh, number), expected(FrameType::join)) << type;
    EXPECT_EQ(check_client_frame(Channel::admin, fresh, number), expected(FrameType::admin_hello)) << type;
  }
}

TEST(Session, BeforeJoinOnlyPingAndGoodbye) {
  using enum SessionState;
  EXPECT_EQ(check(Channel::request, greeted, FrameType::ping), ErrorCode::none);
  EXPECT_EQ(check(Channel::request, greeted, FrameType::goodbye), ErrorCode::none);
  for (const FrameType type : {FrameType::get_mesh_list, FrameType::get_base_mesh, FrameType::get_next_packet,
                               FrameType::get_packet, FrameType::cancel}) {
    EXPECT_EQ(check(Channel::request, greeted, type), ErrorCode::not_joined);
    EXPECT_EQ(check(Channel::request, joined, type), ErrorCode::none);
  }
}

TEST(Session, KnownTypesInTheWrongPlaceEndTheSession) {
  using enum SessionState;
  for (const SessionState state : {greeted, joined}) {
    EXPECT_EQ(check(Channel::request, state, FrameType::hello), ErrorCode::wrong_state);
    EXPECT_EQ(check(Channel::request, state, FrameType::join), ErrorCode::wrong_state);
    EXPECT_EQ(check(Channel::request, state, FrameType::chunk), ErrorCode::wrong_state);
    EXPECT_EQ(check(Channel::request, state, FrameType::notice), ErrorCode::wrong_state);
    EXPECT_EQ(check(Channel::request, state, FrameType::admin_remove), ErrorCode::wrong_state);
  }
  EXPECT_EQ(check(Channel::data, joined, FrameType::join), ErrorCode::wrong_state);
  EXPECT_EQ(check(Channel::data, joined, FrameType::get_next_packet), ErrorCode::wrong_state);
  EXPECT_EQ(check(Channel::admin, joined, FrameType::get_mesh_list), ErrorCode::wrong_state);
  EXPECT_EQ(check(Channel::admin, joined, FrameType::ingest_ok), ErrorCode::wrong_state);
  EXPECT_EQ(check(Channel::admin, joined, FrameType::ingest_data), ErrorCode::none);
}

TEST(Session, UnknownTypesLeaveItStanding) {
  using enum SessionState;
  for (const std::uint16_t type :
       {std::uint16_t{0}, std::uint16_t{0x000a}, std::uint16_t{0x0015}, std::uint16_t{0xffff}}) {
    EXPECT_EQ(check_client_frame(Channel::request, greeted, type), ErrorCode::unknown_type);
    EXPECT_EQ(check_client_frame(Channel::data, joined, type), ErrorCode::unknown_type);
    EXPECT_EQ(check_client_frame(Channel::admin, joined, type), ErrorCode::unknown_type);
  }
  EXPECT_EQ(code_ends(ErrorCode::unknown_type), Ends::request);
}

TEST(OpenRequests, EightAndNoIdTwice) {
  OpenRequests open;
  EXPECT_EQ(open.open(0), ErrorCode::malformed);
  for (std::uint32_t id = 1; id <= kMaxOpenRequests; ++id) EXPECT_EQ(open.open(id), ErrorCode::none);
  EXPECT_EQ(open.open(3), ErrorCode::duplicate_id);
  EXPECT_EQ(open.open(99), ErrorCode::too_many_requests);
  EXPECT_EQ(open.count(), kMaxOpenRequests);
  EXPECT_TRUE(open.end(3));
  EXPECT_FALSE(open.end(3));
  EXPECT_FALSE(open.is_open(3));
  EXPECT_TRUE(open.is_open(8));
  EXPECT_EQ(open.open(99), ErrorCode::none);
  EXPECT_EQ(open.open(3), ErrorCode::too_many_requests);
}

}  // namespace
}  // namespace pmcd::proto
