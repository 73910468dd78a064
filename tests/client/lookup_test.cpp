// SPDX-License-Identifier: MIT
// Looking hosts up: numbers at once, and a look-up that hangs holds nobody up. The program's own getaddrinfo stands
// before the system's, so that it can hang.
#include "client/lookup.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "client/session.h"

namespace {

std::atomic<int> asked{0};
std::atomic<bool> released{false};

}  // namespace

extern "C" int getaddrinfo(const char* node, const char* service, const addrinfo* hints, addrinfo** list) {
  ++asked;
  if (node != nullptr && std::strcmp(node, "hangs.test") == 0) {
    while (!released) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return EAI_AGAIN;
  }
  static const auto real = reinterpret_cast<int (*)(const char*, const char*, const addrinfo*, addrinfo**)>(
      ::dlsym(RTLD_NEXT, "getaddrinfo"));
  return real(node, service, hints, list);
}

namespace pmcd::client {
namespace {

using namespace std::chrono_literals;

TEST(Lookup, NumbersNeverAskTheSystem) {
  boost::asio::io_context io;
  const int before = asked;
  for (const char* number : {"127.0.0.1", "::1", "fe80::1%1"}) {
    const Lookup lookup(io, number, 7621);
    ASSERT_TRUE(lookup.done()) << number;
    ASSERT_EQ(lookup.endpoints().size(), 1u);
    EXPECT_EQ(lookup.endpoints()[0].port(), 7621);
    EXPECT_EQ(lookup.failure(), "");
  }
  EXPECT_EQ(asked, before);
}

TEST(Lookup, NamesDo) {
  boost::asio::io_context io;
  const Lookup lookup(io, "localhost", 99);
  while (!lookup.done()) io.run_one_for(5s);
  ASSERT_FALSE(lookup.endpoints().empty()) << lookup.failure();
  EXPECT_TRUE(lookup.endpoints()[0].address().is_loopback());
  EXPECT_EQ(lookup.endpoints()[0].port(), 99);
}

TEST(Lookup, ConnectingGivesUpALookUpThatHangs) {
  released = false;
  Options options;
  options.connect_timeout = 100ms;
  const auto before = std::chrono::steady_clock::now();
  {
    const auto session = Session::connect({"hangs.test", 1}, options);
    ASSERT_FALSE(session.ok());
    EXPECT_EQ(session.error().failure, Failure::timed_out);
    EXPECT_NE(session.error().text.find("looking up hangs.test"), std::string::npos) << session.error().text;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - before, 2s) << "nor does the end wait for it";
  released = true;  // the thread that was left behind answers nobody and goes
}

}  // namespace
}  // namespace pmcd::client
