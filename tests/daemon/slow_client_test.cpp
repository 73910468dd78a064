// SPDX-License-Identifier: MIT
// Clients that take their data slowly or not at all, and send theirs byte by byte: who is dropped, after what time, and
// that the others lose no more than that time. The judgement itself, on a clock of its own, is in pace_test.cpp.
#include <gtest/gtest.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/daemon/log_lines.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

/// What a loaded machine may add to a time.
constexpr milliseconds kSlack{2'500};

void provide(const ServerInThread& server, const std::string& name, const FakeMesh& mesh) {
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest(name, mesh), "ok");
}

/// "127.0.0.1:port" of the client's end of its request channel, by which the log names it.
std::string name_of(const RawSession& session) {
  return "127.0.0.1:" + std::to_string(port_of(session.requests.fd()));
}

template <typename Done>
bool comes_true(Done done) {
  const auto deadline = Clock::now() + kPatience;
  while (!done() && Clock::now() < deadline) std::this_thread::sleep_for(milliseconds(5));
  return done();
}

/// Takes `rate` bytes a second, `most` at a time, from the data channel until the daemon says something on the request
/// channel; how long that took. None if it said nothing for `time`.
std::optional<Clock::duration> take_slowly(RawSession& session, double rate, std::size_t most, milliseconds time) {
  const auto start = Clock::now();
  std::vector<char> piece(most);
  double taken = 0;
  while (Clock::now() - start < time) {
    if (session.requests.stirs(milliseconds(10))) return Clock::now() - start;
    const double due = rate * std::chrono::duration<double>(Clock::now() - start).count() - taken;
    const auto size = static_cast<std::size_t>(std::clamp(due, 0.0, static_cast<double>(most)));
    if (size == 0) continue;
    const ssize_t count = ::recv(session.data.fd(), piece.data(), size, MSG_DONTWAIT);
    if (count > 0) taken += static_cast<double>(count);
  }
  return std::nullopt;
}

/// How reading on ends: 0 for an orderly end, else the error.
int end_of(const RawConnection& connection) {
  std::array<char, 65'536> buffer{};
  while (true) {
    const ssize_t count = ::recv(connection.fd(), buffer.data(), buffer.size(), 0);
    if (count == 0) return 0;
    if (count < 0 && errno != EINTR) return errno;
  }
}

TEST(SlowClient, ThatStopsReadingLosesItsSlotAndLeavesNothingBehind) {
  net::Limits limits;
  limits.stall = milliseconds(800);
  limits.linger = milliseconds(200);
  const LogLines log;
  ServerInThread server(limits, 1);
  const FakeMesh small = fake_mesh(2, {100});
  provide(server, "big", fake_mesh(1, {8'000'000}));
  provide(server, "small", small);
  auto stalled = RawSession::open(server.request_port(), 4096);
  stalled.open_mesh(1, "big");
  ASSERT_TRUE(stalled.data.stirs(kPatience));
  const std::uint16_t stalled_port = port_of(stalled.data.fd());
  EXPECT_TRUE(comes_true([&] { return kernel_holds(server.data_port(), stalled_port) > 1'000; }));
  auto next = RawSession::open(server.request_port());
  const auto asked = Clock::now();
  next.open_mesh(1, "small");
  EXPECT_EQ(next.next_transfer().bytes, small.packets[0]);
  const auto lost = std::chrono::duration_cast<milliseconds>(Clock::now() - asked);
  RecordProperty("lost_ms", static_cast<int>(lost.count()));
  EXPECT_GT(lost, limits.stall / 2) << "the slot was free too early to show anything";
  EXPECT_LT(lost, limits.stall + kSlack) << "the next one lost more than the stall time";

  EXPECT_EQ(expect_error(stalled.requests, 0), "stalled");
  const auto lines = log.with(name_of(stalled) + ": closed");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find(": closed: stalled: the data channel acknowledges nothing"), std::string::npos) << lines[0];
  EXPECT_TRUE(comes_true([&] { return kernel_holds(server.data_port(), stalled_port) == 0; }))
      << "what was not taken still fills the kernel's memory";
  EXPECT_EQ(end_of(stalled.data), ECONNRESET);
}

scheduler::Policy with_quantum(milliseconds quantum) {
  scheduler::Policy policy = ServerInThread::fifo(1);
  policy.quantum = quantum;
  return policy;
}

/// What of a client that takes nothing holds the only slot: its second mesh, of which no chunk has room behind the
/// first one's, or a packet whose end waits in the channel already. A turn ends all the same, long before the client is
/// dropped.
TEST(SlowClient, ThatTakesNothingLosesItsTurnWhateverOfItHoldsTheSlot) {
  net::Limits limits;
  limits.stall = milliseconds(60'000);
  limits.linger = milliseconds(200);
  constexpr milliseconds kQuantum{200};
  for (const std::size_t bytes : {8'000'000U, 9'000U}) {
    ServerInThread server(limits, with_quantum(kQuantum));
    const FakeMesh small = fake_mesh(2, {100});
    ingest(server, "first", fake_mesh(1, {bytes}));
    ingest(server, "second", fake_mesh(3, {8'000'000}));
    ingest(server, "small", small);
    auto stalled = RawSession::open(server.request_port(), 4096);
    stalled.open_mesh(1, "first");
    ASSERT_TRUE(stalled.data.stirs(kPatience));
    std::this_thread::sleep_for(milliseconds(100));
    stalled.open_mesh(2, "second");
    auto next = RawSession::open(server.request_port());
    const auto asked = Clock::now();
    next.open_mesh(1, "small");
    EXPECT_EQ(next.next_transfer().bytes, small.packets[0]);
    EXPECT_LT(Clock::now() - asked, 4 * kQuantum + kSlack) << bytes;
  }
}

TEST(SlowClient, WhoseSessionEndsLeavesLittleBehind) {
  net::Limits limits;
  limits.linger = milliseconds(200);
  ServerInThread server(limits, 1);
  provide(server, "big", fake_mesh(1, {8'000'000}));
  auto lost = RawSession::open(server.request_port(), 4096);
  lost.open_mesh(1, "big");
  const std::uint16_t port = port_of(lost.data.fd());
  EXPECT_TRUE(comes_true([&] { return kernel_holds(server.data_port(), port) > 1'000; }));
  lost.requests.close();
  // What was on its way may still arrive, and is no more than the kernel was given.
  EXPECT_LT(kernel_holds(server.data_port(), port), 4 * limits.first_chunk_bytes);
  EXPECT_EQ(end_of(lost.data), 0);
  EXPECT_TRUE(comes_true([&] { return kernel_holds(server.data_port(), port) == 0; }));
}

TEST(SlowClient, AByteATimeIsTooLittleAndTheOthersAreUnharmed) {
  net::Limits limits;
  limits.stall = milliseconds(800);
  limits.linger = milliseconds(200);
  ServerInThread server(limits, 2);
  const FakeMesh small = fake_mesh(4, {100, 20'000, 300'000});
  provide(server, "big", fake_mesh(3, {8'000'000}));
  provide(server, "small", small);
  auto slow = RawSession::open(server.request_port(), 4096);
  slow.open_mesh(1, "big");
  std::atomic<bool> over = false;
  std::thread other([&] {
    auto session = RawSession::open(server.request_port());
    while (!over) EXPECT_EQ(session.fetch("small"), small.packets);
  });
  const auto dropped = take_slowly(slow, 10, 1, kPatience);
  over = true;
  other.join();
  ASSERT_TRUE(dropped);
  EXPECT_GE(*dropped, limits.stall / 2);
  EXPECT_LT(*dropped, limits.stall + kSlack);
  EXPECT_EQ(expect_error(slow.requests, 0), "stalled");
}

/// Below the least rate, at its double, and below it where there is none; the times are a fifteenth of the daemon's.
TEST(SlowClient, BelowTheLeastRateIsDroppedAndAtTwiceTheRateIsNot) {
  constexpr double kRate = 100'000;
  net::Limits limits;
  limits.stall = milliseconds(5'000);
  limits.linger = milliseconds(200);
  limits.min_rate = static_cast<std::uint64_t>(kRate);
  limits.rate_window = milliseconds(2'000);
  const LogLines log;
  ServerInThread server(limits, 2);
  limits.min_rate = 0;
  ServerInThread lenient(limits, 1);
  const FakeMesh big = fake_mesh(5, {8'000'000});
  provide(server, "big", big);
  provide(lenient, "big", big);
  auto below = RawSession::open(server.request_port(), 8'192);
  auto above = RawSession::open(server.request_port(), 8'192);
  auto tolerated = RawSession::open(lenient.request_port(), 8'192);
  for (RawSession* session : {&below, &above, &tolerated}) session->open_mesh(1, "big");
  constexpr milliseconds kWatched{4'500};
  std::thread above_reads([&] { EXPECT_FALSE(take_slowly(above, 2 * kRate, 8'192, kWatched)) << "twice the rate"; });
  std::thread tolerated_reads([&] { EXPECT_FALSE(take_slowly(tolerated, 0.4 * kRate, 8'192, kWatched)) << "no rate"; });
  const auto dropped = take_slowly(below, 0.4 * kRate, 8'192, kPatience);
  above_reads.join();
  tolerated_reads.join();
  ASSERT_TRUE(dropped);
  RecordProperty("dropped_ms", static_cast<int>(std::chrono::duration_cast<milliseconds>(*dropped).count()));
  // The first second of a transfer belongs to the round trip and is not counted.
  EXPECT_GE(*dropped, limits.rate_window + milliseconds(500));
  EXPECT_LT(*dropped, limits.rate_window + milliseconds(1'000) + kSlack);
  EXPECT_EQ(expect_error(below.requests, 0), "stalled");
  const auto lines = log.with(name_of(below) + ": closed");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("acknowledges less than the least rate"), std::string::npos) << lines[0];
  for (RawSession* session : {&above, &tolerated}) {
    session->requests.send(proto::encode(proto::Ping{7}));
    EXPECT_EQ(expect<proto::Pong>(session->requests).id, 7U);
  }
}

/// Each byte in a segment of its own.
void send_slowly(const RawConnection& connection, proto::ByteView bytes, milliseconds pause) {
  const int on = 1;
  ::setsockopt(connection.fd(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  for (const std::byte byte : bytes) {
    if (::send(connection.fd(), &byte, 1, MSG_NOSIGNAL) != 1) return;
    std::this_thread::sleep_for(pause);
  }
}

TEST(SlowClient, FramesMayComeAByteAtATime) {
  ServerInThread server;
  const FakeMesh mesh = fake_mesh(6, {100, 200});
  provide(server, "m", mesh);
  constexpr milliseconds kPause{1};
  RawSession session;
  session.requests = RawConnection::tcp(server.request_port());
  send_slowly(session.requests, proto::encode(proto::Hello{{}, "slow writer"}), kPause);
  const auto hello = expect<proto::HelloOk>(session.requests);
  session.data = RawConnection::tcp(server.data_port());
  send_slowly(session.data, proto::encode(proto::Join{{}, hello.token}), kPause);
  expect<proto::JoinOk>(session.data);
  send_slowly(session.requests, proto::encode(proto::GetBaseMesh{1, "m"}), kPause);
  EXPECT_EQ(expect<proto::MeshOpened>(session.requests).id, 1U);
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[0]);
  send_slowly(session.requests, proto::encode(proto::GetNextPacket{2, 0}), kPause);
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[1]);
}

TEST(SlowClient, BytesThatTrickleInDoNotPutOffTheTimeForTheFirstFrame) {
  net::Limits limits;
  limits.hello = milliseconds(600);
  ServerInThread server(limits);
  auto requests = RawConnection::tcp(server.request_port());
  auto data = RawConnection::tcp(server.data_port());
  const auto start = Clock::now();
  const auto trickle = [](const RawConnection& connection, const proto::Bytes& frame) {
    send_slowly(connection, proto::ByteView(frame).first(20), milliseconds(100));
  };
  std::thread hello([&] { trickle(requests, proto::encode(proto::Hello{{}, "a name that is long enough"})); });
  std::thread join([&] { trickle(data, proto::encode(proto::Join{})); });
  EXPECT_EQ(expect_error(requests, 0), "hello_timeout");
  EXPECT_EQ(expect_error(data, 0), "join_timeout");
  const auto told = Clock::now() - start;
  hello.join();
  join.join();
  EXPECT_GE(told, milliseconds(500));
  EXPECT_LT(told, limits.hello + milliseconds(1'300)) << "the bytes took 2 seconds";
}

TEST(JoinTwice, OnTheSameChannelEndsTheSessionAndOnAnotherHarmsNobody) {
  ServerInThread server;
  auto requests = RawConnection::tcp(server.request_port());
  requests.send(proto::encode(proto::Hello{{}, "x"}));
  const proto::Bytes join = proto::encode(proto::Join{{}, expect<proto::HelloOk>(requests).token});
  // Whichever of them is first has the token; the others are refused. More of them would be too many.
  std::vector<RawConnection> data;
  for (int i = 0; i < 5; ++i) data.push_back(RawConnection::tcp(server.data_port()));
  for (RawConnection& connection : data) connection.send(join);
  std::vector<RawConnection*> joined;
  for (RawConnection& connection : data) {
    const auto frame = connection.read();
    ASSERT_TRUE(frame);
    if (frame->is(proto::FrameType::join_ok)) {
      joined.push_back(&connection);
    } else {
      EXPECT_EQ(proto::decode<proto::ErrorMessage>(frame->body).value().code, proto::ErrorCode::bad_token);
      EXPECT_TRUE(connection.closes());
    }
  }
  ASSERT_EQ(joined.size(), 1U);
  requests.send(proto::encode(proto::Ping{3}));
  EXPECT_EQ(expect<proto::Pong>(requests).id, 3U);

  joined[0]->send(join);
  EXPECT_EQ(expect_error(*joined[0], 0), "wrong_state");
  EXPECT_TRUE(joined[0]->closes());
  EXPECT_EQ(expect_error(requests, 0), "channel_lost");
  EXPECT_TRUE(requests.closes());
}

TEST(FrameSize, TheLargestIsTakenAndOneByteMoreIsNot) {
  ServerInThread server;
  auto session = RawSession::open(server.request_port());
  // The length counts the type too.
  const auto unknown = static_cast<proto::FrameType>(0x6000);
  const proto::Bytes largest = proto::make_frame(unknown, proto::Bytes(proto::kMaxClientFrame - 2));
  for (int i = 0; i < 100; ++i) session.requests.send(largest);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(expect_error(session.requests, 0), "unknown_type");
  session.data.send(largest);
  EXPECT_EQ(expect_error(session.data, 0), "unknown_type");
  session.data.send(proto::make_frame(unknown, proto::Bytes(proto::kMaxClientFrame - 1)));
  EXPECT_EQ(expect_error(session.data, 0), "frame_too_long");
  EXPECT_TRUE(session.data.closes());
  EXPECT_EQ(expect_error(session.requests, 0), "channel_lost");
  auto other = RawSession::open(server.request_port());
  other.requests.send(proto::make_frame(unknown, proto::Bytes(proto::kMaxClientFrame - 1)));
  EXPECT_EQ(expect_error(other.requests, 0), "frame_too_long");
  EXPECT_TRUE(other.requests.closes());
}

}  // namespace
}  // namespace pmcd::test
