// SPDX-License-Identifier: MIT
// How many may come: sessions in all and from one address, connections that wait to join or to be turned away, and
// what the limit of descriptors allows. Over each of them there is a clear refusal, and places are given back.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <ostream>
#include <string>
#include <thread>
#include <vector>

#include "tests/daemon/daemon_process.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

/// A connection from 127.0.0.`host`.
RawConnection connect_from(unsigned host, std::uint16_t port) {
  RawConnection connection(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl((INADDR_LOOPBACK & 0xffffff00U) | host);
  EXPECT_EQ(::bind(connection.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(::connect(connection.fd(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return connection;
}

/// The answer to a hello from that address: hello_ok, or a refusal as "code: text".
struct Greeting {
  RawConnection connection;
  proto::HelloOk hello;
  std::string refusal;
};

Greeting greet(unsigned host, std::uint16_t port) {
  Greeting greeting{connect_from(host, port), {}, {}};
  greeting.connection.send(proto::encode(proto::Hello{{}, "x"}));
  const auto frame = greeting.connection.read();
  if (!frame) {
    greeting.refusal = "closed";
  } else if (frame->is(proto::FrameType::hello_ok)) {
    greeting.hello = proto::decode<proto::HelloOk>(frame->body).value();
  } else {
    const auto error = proto::decode<proto::ErrorMessage>(frame->body).value();
    greeting.refusal = std::string(proto::code_name(error.code)) + ": " + error.text;
  }
  return greeting;
}

/// A greeting that is not refused, once a place has become free.
Greeting greet_patiently(unsigned host, std::uint16_t port) {
  const auto deadline = Clock::now() + kPatience;
  while (true) {
    Greeting greeting = greet(host, port);
    if (greeting.refusal.empty() || Clock::now() >= deadline) return greeting;
    std::this_thread::sleep_for(milliseconds(10));
  }
}

/// The code with which a data connection is answered; "nothing" if it waits for a join.
std::string data_answer(RawConnection& connection, const std::optional<proto::Token>& token) {
  if (token) connection.send(proto::encode(proto::Join{{}, *token}));
  if (!token && !connection.stirs(milliseconds(100))) return "nothing";
  const auto frame = connection.read();
  if (!frame) return "closed";
  if (frame->is(proto::FrameType::join_ok)) return "join_ok";
  return std::string(proto::code_name(proto::decode<proto::ErrorMessage>(frame->body).value().code));
}

class LimitsTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
};

TEST_F(LimitsTest, SessionsInAllAndFromOneAddress) {
  DaemonProcess daemon(folder_.path(), {"--max-sessions", "5", "--max-sessions-per-address", "2"});
  const std::uint16_t port = daemon.request_port();
  std::vector<Greeting> in;
  for (const unsigned host : {2U, 2U, 3U, 3U}) in.push_back(greet(host, port));
  for (const Greeting& greeting : in) EXPECT_EQ(greeting.refusal, "");
  EXPECT_EQ(greet(2, port).refusal, "too_many_sessions: your address has as many sessions as it may");
  EXPECT_EQ(greet(3, port).refusal, "too_many_sessions: your address has as many sessions as it may");
  in.push_back(greet(4, port));
  EXPECT_EQ(in.back().refusal, "");
  auto over = greet(4, port);
  EXPECT_EQ(over.refusal, "too_many_sessions: the daemon serves as many sessions as it may; try again later");
  EXPECT_TRUE(over.connection.closes());
  // A place is given back however a session ends.
  in[0].connection.send(proto::encode(proto::Goodbye{}));
  EXPECT_TRUE(in[0].connection.closes());
  in[0] = greet_patiently(2, port);
  EXPECT_EQ(in[0].refusal, "");
  in[1].connection.close();
  in[1] = greet_patiently(2, port);
  EXPECT_EQ(in[1].refusal, "");
  in[2].connection.send(proto::Bytes(10));  // what is no frame
  in[2] = greet_patiently(3, port);
  EXPECT_EQ(in[2].refusal, "");
}

TEST_F(LimitsTest, DataConnectionsThatHaveNotJoined) {
  DaemonProcess daemon(folder_.path(), {"--hello-timeout", "1"});
  auto session = greet(2, daemon.request_port());
  auto joined = connect_from(2, session.hello.data_port);
  ASSERT_EQ(data_answer(joined, session.hello.token), "join_ok");
  const std::uint16_t port = session.hello.data_port;
  auto other = greet(2, daemon.request_port());
  // One for the session that waits for its own, and four more.
  std::vector<RawConnection> silent;
  for (int i = 0; i < 5; ++i) silent.push_back(connect_from(2, port));
  for (RawConnection& connection : silent) {
    EXPECT_EQ(data_answer(connection, std::nullopt), "nothing") << "who has joined does not count";
  }
  RawConnection further = connect_from(2, port);
  EXPECT_EQ(data_answer(further, std::nullopt), "too_many_sessions");
  EXPECT_TRUE(further.closes());
  RawConnection elsewhere = connect_from(3, port);
  EXPECT_EQ(data_answer(elsewhere, proto::Token{}), "bad_token") << "another address has places of its own";
  // When their time is over they are told, and their places are free again.
  for (RawConnection& connection : silent) EXPECT_EQ(expect_error(connection, 0), "join_timeout");
  RawConnection late = connect_from(2, port);
  EXPECT_EQ(data_answer(late, other.hello.token), "join_ok");
}

TEST_F(LimitsTest, OneAddressCannotKeepTheOthersFromJoining) {
  DaemonProcess daemon(folder_.path(), {"--max-sessions", "40", "--max-sessions-per-address", "32"});
  std::vector<Greeting> in;
  std::vector<RawConnection> data;
  for (int i = 0; i < 32; ++i) {
    in.push_back(greet(2, daemon.request_port()));
    ASSERT_EQ(in.back().refusal, "");
    data.push_back(connect_from(2, in.back().hello.data_port));
    ASSERT_EQ(data_answer(data.back(), in.back().hello.token), "join_ok");
  }
  std::vector<RawConnection> silent;
  for (int i = 0; i < 200; ++i) silent.push_back(connect_from(2, in[0].hello.data_port));
  for (unsigned host = 3; host < 11; ++host) {
    in.push_back(greet(host, daemon.request_port()));
    ASSERT_EQ(in.back().refusal, "");
    data.push_back(connect_from(host, in.back().hello.data_port));
    EXPECT_EQ(data_answer(data.back(), in.back().hello.token), "join_ok");
  }
}

TEST_F(LimitsTest, AllThatAreRefusedAreToldAndFewOfThemLinger) {
  DaemonProcess daemon(folder_.path(), {"--max-sessions", "1"});
  Greeting in = greet(2, daemon.request_port());
  ASSERT_EQ(in.refusal, "");
  const std::size_t calm = open_descriptors(daemon.id());
  for (const bool talks : {false, true}) {
    std::vector<RawConnection> crowd;
    for (int i = 0; i < 200; ++i) {
      crowd.push_back(connect_from(3, daemon.request_port()));
      if (talks) crowd.back().send(proto::encode(proto::Hello{{}, "x"}));
    }
    std::size_t told = 0;
    for (RawConnection& connection : crowd) told += expect_error(connection, 0) == "too_many_sessions" ? 1 : 0;
    EXPECT_EQ(told, crowd.size());
    // None has closed its side yet.
    EXPECT_LE(open_descriptors(daemon.id()), calm + 64 / 4) << "of one address";
    // Neither does the crowd take the places of other addresses.
    RawConnection stranger = connect_from(7, in.hello.data_port);
    EXPECT_EQ(data_answer(stranger, proto::Token{}), "bad_token");
    for (RawConnection& connection : crowd) EXPECT_TRUE(connection.closes());
  }
  in.connection.send(proto::encode(proto::Ping{1}));
  EXPECT_EQ(expect<proto::Pong>(in.connection).id, 1U);
  in.connection.close();
  EXPECT_EQ(greet_patiently(2, daemon.request_port()).refusal, "");
}

/// A limit of descriptors, and what it allows beside the three listeners and the database.
struct Budget {
  rlim_t descriptors;
  std::size_t sessions;
  std::ptrdiff_t spare;  ///< data connections that are not of a session
};

void PrintTo(const Budget& budget, std::ostream* out) {
  *out << budget.descriptors << " descriptors";
}

class DescriptorsTest : public LimitsTest, public ::testing::WithParamInterface<Budget> {};

TEST_P(DescriptorsTest, NobodyIsLetInForWhomThereIsNone) {
  if (kSanitized) GTEST_SKIP() << "UBSan's look at an object needs a descriptor, and takes the lack of one for a fault";
  const Budget budget = GetParam();
  DaemonProcess daemon(folder_.path(), {"--max-sessions-per-address", "100000"}, [budget] {
    const rlimit few{budget.descriptors, budget.descriptors};
    ::setrlimit(RLIMIT_NOFILE, &few);
  });
  const std::string count = std::to_string(budget.sessions);
  EXPECT_NE(
      daemon.log().find(std::to_string(budget.descriptors) + " descriptors allow " + count + " sessions, not 9000"),
      std::string::npos)
      << daemon.log();
  std::vector<Greeting> in;
  std::vector<RawConnection> data;
  for (std::size_t i = 0; i < budget.sessions; ++i) {
    in.push_back(greet(2, daemon.request_port()));
    ASSERT_EQ(in.back().refusal, "");
    data.push_back(connect_from(2, in.back().hello.data_port));
    ASSERT_EQ(data_answer(data.back(), in.back().hello.token), "join_ok");
  }
  std::vector<Greeting> refused;
  for (int i = 0; i < 100; ++i) {
    refused.push_back(greet(2, daemon.request_port()));
    ASSERT_EQ(refused.back().refusal.substr(0, 18), "too_many_sessions:");
  }
  // Data connections that never join take no more descriptors than were set aside, and the operator still gets in.
  std::vector<RawConnection> crowd;
  for (unsigned i = 0; i < 200; ++i) crowd.push_back(connect_from(3 + i % 50, in[0].hello.data_port));
  const auto turned_away = [&crowd] {
    return std::count_if(crowd.begin(), crowd.end(), [](RawConnection& one) { return one.stirs(milliseconds(0)); });
  };
  const auto deadline = Clock::now() + kPatience;
  while (turned_away() < 200 - budget.spare && Clock::now() < deadline) std::this_thread::sleep_for(milliseconds(10));
  EXPECT_EQ(turned_away(), 200 - budget.spare);
  auto admin = RawAdmin::open(daemon.admin_socket());
  EXPECT_NE(admin.answer(proto::encode(proto::AdminStatus{1})).find("\"sessions\":" + count), std::string::npos);
  EXPECT_EQ(admin.ingest("m", fake_mesh(1, {100, 20'000, 300'000})), "ok");
  const long before = cpu_ms(daemon.id());
  const auto start = Clock::now();
  std::this_thread::sleep_for(milliseconds(300));
  const long used = cpu_ms(daemon.id()) - before;
  const auto passed = std::chrono::duration_cast<milliseconds>(Clock::now() - start).count();
  EXPECT_LT(used, passed / 5) << "somebody spins";
  EXPECT_EQ(daemon.log().find("Too many open files"), std::string::npos) << daemon.log();
  EXPECT_LE(open_descriptors(daemon.id()), budget.descriptors);
  crowd.clear();
  data.clear();
  in.clear();
  EXPECT_EQ(greet_patiently(2, daemon.request_port()).refusal, "");
}

INSTANTIATE_TEST_SUITE_P(Limits, DescriptorsTest,
                         ::testing::Values(Budget{38, 1, 1}, Budget{40, 2, 1}, Budget{64, 8, 1}, Budget{100, 17, 3},
                                           Budget{400, 92, 16}, Budget{513, 120, 21}, Budget{700, 167, 30},
                                           Budget{900, 258, 32}),
                         [](const auto& one) { return "Of" + std::to_string(one.param.descriptors); });

}  // namespace
}  // namespace pmcd::test
