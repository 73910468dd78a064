// SPDX-License-Identifier: MIT
// What the server does when lines break, clients stall or say nothing, meshes vanish and the database is damaged: who
// is dropped with which code, and that everybody else goes on.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "daemon/store/db.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;

class FaultTest : public ::testing::Test {
 protected:
  static net::Limits short_limits() {
    net::Limits limits;
    limits.hello = milliseconds(800);
    limits.join = milliseconds(1'000);
    limits.stall = milliseconds(800);
    limits.linger = milliseconds(200);
    limits.drain = milliseconds(1'000);
    return limits;
  }

  void ingest(const std::string& name, const FakeMesh& mesh, bool replace = false) {
    ASSERT_EQ(RawAdmin::open(server_.admin_socket()).ingest(name, mesh, replace), replace ? "replaced" : "ok");
  }
  /// Waits until the server has so many sessions.
  bool sessions_become(std::size_t wanted) {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (server_.sessions() != wanted && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    return server_.sessions() == wanted;
  }

  ServerInThread server_{short_limits()};
};

TEST_F(FaultTest, SilentConnectionsAreToldAndClosed) {
  auto requests = RawConnection::tcp(server_.request_port());
  auto half = RawConnection::tcp(server_.request_port());
  const proto::Bytes hello = proto::encode(proto::Hello{{}, "slow"});
  half.send(proto::ByteView(hello).first(9));
  auto data = RawConnection::tcp(server_.data_port());
  auto admin = RawConnection::local(server_.admin_socket());
  EXPECT_EQ(expect_error(requests, 0), "hello_timeout");
  EXPECT_EQ(expect_error(half, 0), "hello_timeout");
  EXPECT_EQ(expect_error(data, 0), "join_timeout");
  EXPECT_EQ(expect_error(admin, 0), "hello_timeout");
  for (RawConnection* connection : {&requests, &half, &data, &admin}) EXPECT_TRUE(connection->closes());
  EXPECT_TRUE(sessions_become(0));
}

TEST_F(FaultTest, SessionThatNeverJoinsIsClosedAlthoughItPings) {
  auto requests = RawConnection::tcp(server_.request_port());
  requests.send(proto::encode(proto::Hello{{}, "x"}));
  const auto hello = expect<proto::HelloOk>(requests);
  std::string code;
  for (int i = 0; i < 500 && code.empty(); ++i) {
    requests.send(proto::encode(proto::Ping{1}));
    const auto frame = requests.read();
    ASSERT_TRUE(frame);
    if (frame->is(proto::FrameType::error)) {
      code = proto::code_name(proto::decode<proto::ErrorMessage>(frame->body).value().code);
    }
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_EQ(code, "join_timeout");
  auto data = RawConnection::tcp(server_.data_port());
  data.send(proto::encode(proto::Join{{}, hello.token}));
  EXPECT_EQ(expect_error(data, 0), "bad_token");
}

TEST_F(FaultTest, JoinedSessionMayBeIdleForLong) {
  auto session = RawSession::open(server_.request_port());
  std::this_thread::sleep_for(milliseconds(1'200));
  session.requests.send(proto::encode(proto::Ping{5}));
  EXPECT_EQ(expect<proto::Pong>(session.requests).id, 5U);
}

TEST_F(FaultTest, LostDataChannelClosesTheRequestChannel) {
  auto session = RawSession::open(server_.request_port());
  session.data.close();
  EXPECT_EQ(expect_error(session.requests, 0), "channel_lost");
  EXPECT_TRUE(session.requests.closes());
  EXPECT_TRUE(sessions_become(0));
}

TEST_F(FaultTest, LostRequestChannelClosesTheDataChannel) {
  auto session = RawSession::open(server_.request_port());
  session.requests.close();
  EXPECT_TRUE(session.data.closes());
  EXPECT_TRUE(sessions_become(0));
}

// S-1
TEST_F(FaultTest, LostSessionLeavesTheQueueAndFreesItsSlot) {
  const FakeMesh big = fake_mesh(1, {8'000'000});
  const FakeMesh small = fake_mesh(2, {100, 200});
  ingest("big", big);
  ingest("small", small);
  auto holder = RawSession::open(server_.request_port(), 4096);
  holder.open_mesh(1, "big");
  ASSERT_TRUE(holder.data.stirs(kPatience));
  auto waiting = RawSession::open(server_.request_port());
  waiting.open_mesh(1, "big");
  auto last = RawSession::open(server_.request_port());
  last.open_mesh(1, "small");
  EXPECT_FALSE(last.data.stirs(milliseconds(50)));
  waiting.data.close();
  holder.requests.close();
  EXPECT_EQ(last.next_transfer().bytes, small.packets[0]);
}

TEST_F(FaultTest, ClientThatStopsReadingIsDroppedAndTheOthersGoOn) {
  const FakeMesh big = fake_mesh(3, {8'000'000});
  const FakeMesh small = fake_mesh(4, {100});
  ingest("big", big);
  ingest("small", small);
  auto stalled = RawSession::open(server_.request_port(), 4096);
  stalled.open_mesh(1, "big");
  ASSERT_TRUE(stalled.data.stirs(kPatience));
  auto other = RawSession::open(server_.request_port());
  const auto asked = std::chrono::steady_clock::now();
  other.open_mesh(1, "small");
  EXPECT_EQ(other.next_transfer().bytes, small.packets[0]);
  const auto waited = std::chrono::steady_clock::now() - asked;
  EXPECT_GT(waited, milliseconds(250)) << "the slot was free too early to show anything";
  EXPECT_LT(waited, kPatience);
  EXPECT_EQ(expect_error(stalled.requests, 0), "stalled");
  EXPECT_TRUE(stalled.requests.closes());
  EXPECT_TRUE(sessions_become(1));
}

TEST(SlowClient, ThatReadsIsNotDropped) {
  net::Limits limits;
  limits.stall = milliseconds(1'500);
  ServerInThread server(limits);
  const FakeMesh mesh = fake_mesh(5, {1'000'000});
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", mesh), "ok");
  auto session = RawSession::open(server.request_port(), 4096);
  session.open_mesh(1, "m");
  // Far longer than the stall limit in all, but never a pause as long as it.
  const auto start = std::chrono::steady_clock::now();
  std::array<char, 12'000> piece{};
  std::size_t read = 0;
  while (read < mesh.packets[0].size()) {
    std::this_thread::sleep_for(milliseconds(40));
    const ssize_t count = ::recv(session.data.fd(), piece.data(), piece.size(), 0);
    ASSERT_GT(count, 0);
    read += static_cast<std::size_t>(count);
  }
  EXPECT_GT(std::chrono::steady_clock::now() - start, milliseconds(3'000));
  session.requests.send(proto::encode(proto::Ping{5}));
  EXPECT_EQ(expect<proto::Pong>(session.requests).id, 5U);
}

TEST_F(FaultTest, FloodOfPingsThatNobodyReadsIsBounded) {
  auto requests = RawConnection::tcp(server_.request_port(), 4096);
  requests.send(proto::encode(proto::Hello{{}, "flood"}));
  const auto hello = expect<proto::HelloOk>(requests);
  auto data = RawConnection::tcp(server_.data_port());
  data.send(proto::encode(proto::Join{{}, hello.token}));
  const proto::Bytes ping = proto::encode(proto::Ping{1});
  proto::Bytes flood;
  for (int i = 0; i < 10'000; ++i) flood.insert(flood.end(), ping.begin(), ping.end());
  // Sent until the server closes because its answers are not taken; while it lingers it may take much and forget it.
  bool refused = false;
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!refused && std::chrono::steady_clock::now() < deadline) refused = !requests.send(flood);
  EXPECT_TRUE(refused);
  auto other = RawSession::open(server_.request_port());
  other.requests.send(proto::encode(proto::Ping{2}));
  EXPECT_EQ(expect<proto::Pong>(other.requests).id, 2U);
}

TEST_F(FaultTest, RemovedOrReplacedMeshIsNeverMixed) {
  const FakeMesh old_mesh = fake_mesh(6, {10, 20, 30});
  const FakeMesh new_mesh = fake_mesh(7, {40, 50, 60});
  ingest("m", old_mesh);
  auto session = RawSession::open(server_.request_port());
  const auto opened = session.open_mesh(1, "m");
  EXPECT_EQ(session.next_transfer().bytes, old_mesh.packets[0]);
  ingest("m", new_mesh, true);
  const auto replaced = expect_notice(session.requests, proto::NoticeKind::mesh_retired);
  EXPECT_EQ(replaced.handle, opened.handle);
  EXPECT_EQ(replaced.seconds, 600U);
  session.requests.send(proto::encode(proto::GetNextPacket{2, opened.handle}));
  EXPECT_EQ(session.next_transfer().bytes, old_mesh.packets[1]) << "who has begun keeps what it has begun";
  const auto again = session.open_mesh(3, "m");
  EXPECT_NE(again.handle, opened.handle);
  EXPECT_EQ(again.generation, new_mesh.directory.generation);
  EXPECT_EQ(session.next_transfer().bytes, new_mesh.packets[0]);
  RawAdmin::open(server_.admin_socket()).answer(proto::encode(proto::AdminRemove{1, "m"}));
  EXPECT_EQ(expect_notice(session.requests, proto::NoticeKind::mesh_retired).handle, again.handle);
  session.requests.send(proto::encode(proto::GetNextPacket{4, again.handle}));
  EXPECT_EQ(session.next_transfer().bytes, new_mesh.packets[1]);
  session.requests.send(proto::encode(proto::GetNextPacket{5, opened.handle}));
  EXPECT_EQ(session.next_transfer().bytes, old_mesh.packets[2]);
  session.requests.send(proto::encode(proto::GetBaseMesh{6, "m"}));
  EXPECT_EQ(expect_error(session.requests, 6), "unknown_mesh");
}

//
TEST_F(FaultTest, SameContentIngestedAgainGoesOn) {
  const FakeMesh mesh = fake_mesh(8, {10, 20, 30});
  ingest("m", mesh);
  auto session = RawSession::open(server_.request_port());
  const auto opened = session.open_mesh(1, "m");
  session.next_transfer();
  ingest("m", mesh, true);
  EXPECT_EQ(expect_notice(session.requests, proto::NoticeKind::mesh_retired).handle, opened.handle);
  EXPECT_EQ(session.open_mesh(2, "m").handle, opened.handle);
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[0]);
  session.requests.send(proto::encode(proto::GetNextPacket{3, opened.handle}));
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[1]);
}

//
TEST(Grace, SameContentIngestedAgainOutlivesIt) {
  net::Limits limits;
  limits.grace = milliseconds(100);
  ServerInThread server(limits);
  const FakeMesh mesh = fake_mesh(8, {10, 20, 30});
  auto admin = RawAdmin::open(server.admin_socket());
  ASSERT_EQ(admin.ingest("m", mesh), "ok");
  auto session = RawSession::open(server.request_port());
  const auto opened = session.open_mesh(1, "m");
  session.next_transfer();
  ASSERT_EQ(admin.ingest("m", mesh, true), "replaced");
  std::this_thread::sleep_for(milliseconds(400));
  session.requests.send(proto::encode(proto::GetNextPacket{2, opened.handle}));
  const auto transfer = session.next_transfer();
  EXPECT_EQ(transfer.packet, 1U);
  EXPECT_EQ(transfer.bytes, mesh.packets[1]);
}

TEST_F(FaultTest, AnswersThatAreNotTakenEndTheSessionThoughItIsSilent) {
  auto session = RawSession::open(server_.request_port(), 0, 4096);
  ASSERT_TRUE(sessions_become(1));
  proto::Bytes pings;
  for (std::uint32_t id = 1; id <= 5'000; ++id) {
    const proto::Bytes ping = proto::encode(proto::Ping{id});
    pings.insert(pings.end(), ping.begin(), ping.end());
  }
  session.requests.send(pings);
  EXPECT_TRUE(sessions_become(0)) << "50 KB of answers wait, in a window of a few";
}

TEST_F(FaultTest, DamagedPacketMakesItsMeshUnavailableAndNothingElse) {
  const FakeMesh mesh = fake_mesh(9, {10, 20, 30});
  const FakeMesh good = fake_mesh(10, {10, 20});
  ingest("m", mesh);
  ingest("good", good);
  store::Db(server_.database())
      .execute(
          "UPDATE packet SET data = zeroblob(68) WHERE level = 1 AND mesh = (SELECT id FROM mesh WHERE name = 'm')");
  auto session = RawSession::open(server_.request_port());
  session.open_mesh(1, "m");
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[0]);
  session.requests.send(proto::encode(proto::GetNextPacket{2, 0}));
  EXPECT_EQ(expect_error(session.requests, 2), "unavailable");
  EXPECT_EQ(session.fetch("good"), good.packets);
}

TEST_F(FaultTest, DrainLetsTheRunningTransferEndAndTellsTheOthers) {
  const FakeMesh big = fake_mesh(11, {3'000'000});
  ingest("big", big);
  auto running = RawSession::open(server_.request_port(), 4096);
  running.open_mesh(1, "big");
  ASSERT_TRUE(running.data.stirs(kPatience));
  auto waiting = RawSession::open(server_.request_port());
  waiting.open_mesh(1, "big");
  std::thread drain([this] { EXPECT_TRUE(server_.drain()); });
  EXPECT_EQ(running.next_transfer().bytes, big.packets[0]);
  for (RawSession* session : {&running, &waiting}) {
    const auto notice = expect_notice(session->requests, proto::NoticeKind::draining);
    EXPECT_EQ(notice.handle, 0U);
    EXPECT_EQ(notice.seconds, 1U);
    EXPECT_EQ(expect_error(session->requests, 0), "shutting_down");
  }
  EXPECT_TRUE(waiting.data.closes()) << "what waited is not begun any more";
  drain.join();
  EXPECT_EQ(::access(server_.admin_socket().c_str(), F_OK), -1);
}

TEST_F(FaultTest, DrainDoesNotWaitForEverForAStalledClient) {
  ingest("big", fake_mesh(12, {8'000'000}));
  auto stalled = RawSession::open(server_.request_port(), 4096);
  stalled.open_mesh(1, "big");
  ASSERT_TRUE(stalled.data.stirs(kPatience));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(server_.drain());
  EXPECT_LT(std::chrono::steady_clock::now() - start, milliseconds(3'000));
}

TEST(FaultLimits, SessionsOverTheLimitAreTold) {
  net::Limits limits;
  limits.sessions = 3;
  ServerInThread server(limits);
  std::vector<RawSession> sessions;
  for (int i = 0; i < 3; ++i) sessions.push_back(RawSession::open(server.request_port()));
  auto over = RawConnection::tcp(server.request_port());
  EXPECT_EQ(expect_error(over, 0), "too_many_sessions");
  EXPECT_TRUE(over.closes());
  sessions[1].requests.send(proto::encode(proto::Goodbye{}));
  EXPECT_TRUE(sessions[1].requests.closes());
  sessions[1] = {};
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (server.sessions() > 2 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  auto again = RawSession::open(server.request_port());
  again.requests.send(proto::encode(proto::Ping{1}));
  EXPECT_EQ(expect<proto::Pong>(again.requests).id, 1U);
}

//
TEST(FaultLimits, HandlesOfASessionAreBounded) {
  net::Limits limits;
  limits.meshes_per_session = 2;
  ServerInThread server(limits);
  for (const char* name : {"a", "b", "c"}) {
    ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest(name, fake_mesh(1, {10})), "ok");
  }
  auto session = RawSession::open(server.request_port());
  session.open_mesh(1, "a");
  session.next_transfer();
  session.open_mesh(2, "b");
  session.next_transfer();
  session.requests.send(proto::encode(proto::GetBaseMesh{3, "c"}));
  EXPECT_EQ(expect_error(session.requests, 3), "too_many_requests");
  session.open_mesh(4, "a");
  EXPECT_EQ(session.next_transfer().result, proto::TransferResult::complete);
}

}  // namespace
}  // namespace pmcd::test
