// SPDX-License-Identifier: MIT
// The budget of log lines and the counting of addresses.
#include <gtest/gtest.h>

#include "daemon/net/address_table.h"
#include "daemon/net/log_budget.h"

namespace pmcd::net {
namespace {

using namespace std::chrono_literals;

TEST(LogBudget, BeginsAnewEachSecond) {
  LogBudget budget(3);
  const Clock::time_point start{1000s};
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(budget.take(start + i * 100ms));
  EXPECT_FALSE(budget.take(start + 500ms));
  EXPECT_FALSE(budget.take(start + 999ms));
  EXPECT_TRUE(budget.take(start + 1s));
  EXPECT_TRUE(budget.take(start + 1500ms));
}

TEST(AddressTable, CountsByAddressAndByNetwork) {
  AddressTable table(2);
  const auto key = [](const char* text) { return AddressTable::Key(asio::ip::make_address(text)); };
  EXPECT_TRUE(table.enter(key("192.0.2.1")));
  EXPECT_TRUE(table.enter(key("::ffff:192.0.2.1"))) << "the same address in another dress";
  EXPECT_FALSE(table.enter(key("192.0.2.1")));
  EXPECT_TRUE(table.enter(key("192.0.2.2")));
  EXPECT_TRUE(table.enter(key("2001:db8:1:2::1")));
  EXPECT_TRUE(table.enter(key("2001:db8:1:2:ffff::9")));
  EXPECT_FALSE(table.enter(key("2001:db8:1:2::3"))) << "the same network";
  EXPECT_TRUE(table.enter(key("2001:db8:1:3::1")));
  table.leave(key("192.0.2.1"));
  EXPECT_TRUE(table.enter(key("192.0.2.1")));
  EXPECT_EQ(table.addresses(), 4U);
  table.leave(key("192.0.2.2"));
  EXPECT_EQ(table.addresses(), 3U) << "who has left takes no memory";
}

}  // namespace
}  // namespace pmcd::net
