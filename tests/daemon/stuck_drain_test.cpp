// SPDX-License-Identifier: MIT
// The end of the server with peers that take nothing of what it writes, or stopped in the middle of what they said: it
// is as orderly as any other and takes no longer than its times.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "proto/admin.h"
#include "proto/messages.h"
#include "tests/daemon/jam.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"
#include "tests/store/fake_mesh.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

/// What a loaded machine may add to a time.
constexpr milliseconds kDrainSlack{2'500};

net::Limits short_end() {
  net::Limits limits;
  limits.drain = milliseconds(400);
  limits.linger = milliseconds(200);
  limits.stall = milliseconds(30'000);  // nobody is dropped before the end
  return limits;
}

class StuckDrainTest : public testing::Test {
 protected:
  /// Ends the server, whose peers are still there.
  void expect_orderly_end() {
    const auto start = Clock::now();
    EXPECT_TRUE(server_.drain());
    const auto took = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
    RecordProperty("took_ms", static_cast<int>(took.count()));
    EXPECT_LT(took, limits_.drain + limits_.linger + kDrainSlack);
  }
  RawSession session(int receive_buffer = 4096, int request_buffer = 4096) {
    return RawSession::open(server_.request_port(), receive_buffer, request_buffer);
  }
  void ingest(const std::string& name, const FakeMesh& mesh) {
    ASSERT_EQ(RawAdmin::open(server_.admin_socket()).ingest(name, mesh), "ok");
  }

  const net::Limits limits_ = short_end();
  ServerInThread server_{limits_, 2};
};

TEST_F(StuckDrainTest, ClientsThatTakeNoAnswers) {
  auto pinging = session();
  auto asking = session();
  jam(pinging.requests, proto::encode(proto::Ping{1}));
  jam(asking.requests, proto::encode(proto::GetNextPacket{1, 0}));
  expect_orderly_end();
}

TEST_F(StuckDrainTest, ClientsThatTakeNoPackets) {
  ingest("m", fake_mesh(1, {8'000'000}));
  std::vector<RawSession> clients;
  for (std::uint32_t i = 0; i < 4; ++i) {
    clients.push_back(session());
    clients.back().open_mesh(1, "m");
  }
  ASSERT_TRUE(clients[0].data.stirs(kPatience) && clients[1].data.stirs(kPatience)) << "two run and two wait";
  expect_orderly_end();
}

TEST_F(StuckDrainTest, OperatorsWhoTakeNoAnswers) {
  // About 150 kB of JSON each time: who waits there is in the middle of an answer.
  ingest("m", fake_mesh(2, std::vector<std::size_t>(store::kMaxLevels)));
  auto pinging = RawAdmin::open(server_.admin_socket());
  auto showing = RawAdmin::open(server_.admin_socket());
  jam(pinging.connection, proto::encode(proto::Ping{1}));
  jam(showing.connection, proto::encode(proto::AdminShow{1, "m"}));
  expect_orderly_end();
}

TEST_F(StuckDrainTest, PeersWhoStoppedInTheMiddle) {
  const auto half = [](const proto::Bytes& frame) { return proto::ByteView(frame).first(frame.size() / 2); };
  auto hello = RawConnection::tcp(server_.request_port());
  hello.send(half(proto::encode(proto::Hello{{}, "half"})));
  auto greeted = RawConnection::tcp(server_.request_port());
  greeted.send(proto::encode(proto::Hello{{}, "no data channel"}));
  const auto token = expect<proto::HelloOk>(greeted).token;
  auto join = RawConnection::tcp(server_.data_port());
  join.send(half(proto::encode(proto::Join{{}, token})));
  auto request = session();
  request.requests.send(half(proto::encode(proto::GetBaseMesh{1, "a mesh"})));
  const FakeMesh mesh = fake_mesh(3, {100'000});
  auto upload = RawAdmin::open(server_.admin_socket());
  upload.connection.send(proto::encode(proto::IngestBegin{1, false, "m", mesh.directory_bytes()}));
  expect<proto::IngestReady>(upload.connection);
  upload.connection.send(proto::encode_ingest_data_header({1, 0, 0}, 100'000));
  upload.connection.send(proto::ByteView(mesh.packets[0]).first(50'000));
  expect_orderly_end();
}

}  // namespace
}  // namespace pmcd::test
