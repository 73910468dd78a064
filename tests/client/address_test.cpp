// SPDX-License-Identifier: MIT
// HOST[:PORT] in every form that people write.
#include "client/address.h"

#include <gtest/gtest.h>

namespace pmcd::client {
namespace {

TEST(Address, Forms) {
  EXPECT_EQ(parse_address("localhost").value(), (Address{"localhost", 7621}));
  EXPECT_EQ(parse_address("localhost:80").value(), (Address{"localhost", 80}));
  EXPECT_EQ(parse_address("127.0.0.1:65535").value(), (Address{"127.0.0.1", 65535}));
  EXPECT_EQ(parse_address("[::1]").value(), (Address{"::1", 7621}));
  EXPECT_EQ(parse_address("[fe80::1]:9").value(), (Address{"fe80::1", 9}));
  EXPECT_EQ(to_string({"::1", 9}), "[::1]:9");
  EXPECT_EQ(to_string({"a", 9}), "a:9");
}

TEST(Address, Refused) {
  for (const char* bad : {"", ":80", "a:", "a:0", "a:65536", "a:x", "a:80x", "a:-1", "::1", "fe80::1:80", "[::1", "[]",
                          "[::1]80", "[::1]:", "a:99999999999999999999"}) {
    const auto parsed = parse_address(bad);
    ASSERT_FALSE(parsed.ok()) << bad;
    EXPECT_EQ(parsed.error().failure, Failure::bad_address) << bad;
  }
  EXPECT_NE(parse_address("::1").error().text.find("[::1]:7621"), std::string::npos) << "says what to write";
}

}  // namespace
}  // namespace pmcd::client
