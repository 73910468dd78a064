// SPDX-License-Identifier: MIT
// What clients get when they do everything right: lists, meshes packet by packet, several at once, in the promised
// order.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <thread>
#include <vector>

#include "proto/mesh_list.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using proto::TransferResult;

void ingest(ServerInThread& server, const std::string& name, const FakeMesh& mesh, bool replace = false) {
  auto admin = RawAdmin::open(server.admin_socket());
  ASSERT_EQ(admin.ingest(name, mesh, replace), replace ? "replaced" : "ok");
}

TEST(Session, HelloTellsWhatAClientNeeds) {
  ServerInThread server;
  auto requests = RawConnection::tcp(server.request_port());
  requests.send(proto::encode(proto::Hello{{}, "test"}));
  const auto hello = expect<proto::HelloOk>(requests);
  EXPECT_EQ(hello.version, proto::Version{});
  EXPECT_EQ(hello.data_port, server.data_port());
  EXPECT_EQ(hello.join_seconds, 30);
  EXPECT_EQ(hello.max_open_requests, 8);
  EXPECT_EQ(hello.agent, "pmcd test");
  auto other = RawConnection::tcp(server.request_port());
  other.send(proto::encode(proto::Hello{{}, "test"}));
  EXPECT_NE(expect<proto::HelloOk>(other).token, hello.token);
}

TEST(Session, MeshList) {
  ServerInThread server;
  auto session = RawSession::open(server.request_port());
  session.requests.send(proto::encode(proto::GetMeshList{1}));
  auto transfer = session.next_transfer();
  EXPECT_EQ(transfer.id, 1U);
  EXPECT_EQ(transfer.handle, 0U);
  EXPECT_EQ(transfer.packet, 0U);
  EXPECT_EQ(transfer.result, TransferResult::complete);
  EXPECT_TRUE(proto::decode_mesh_page(transfer.bytes).value().entries.empty());

  const FakeMesh mesh = fake_mesh(1, {100, 2000});
  ingest(server, "b", mesh);
  ingest(server, "a", fake_mesh(2, {50}));
  session.requests.send(proto::encode(proto::GetMeshList{1}));
  transfer = session.next_transfer();
  const auto list = proto::decode_mesh_page(transfer.bytes);
  ASSERT_TRUE(list.ok()) << list.error().detail;
  ASSERT_EQ(list.value().entries.size(), 2U);
  EXPECT_EQ(list.value().entries[0].name, "a");
  EXPECT_TRUE(list.value().entries[0].lossless);
  proto::MeshListEntry expected;
  expected.name = "b";
  expected.generation = mesh.directory.generation;
  expected.vertices = mesh.directory.levels[1].vertices;
  expected.faces = mesh.directory.levels[1].faces;
  expected.levels = 2;
  expected.bytes = mesh.packets[0].size() + mesh.packets[1].size();
  expected.float64 = true;
  expected.bits = 14;
  expected.box_min = mesh.directory.box_min;
  expected.box_max = mesh.directory.box_max;
  EXPECT_EQ(list.value().entries[1], expected);
}

TEST(Session, FetchesEveryPacketAndThenEndOfMesh) {
  ServerInThread server;
  const FakeMesh mesh = fake_mesh(3, {100, 0, 200'000, 1'000'000});
  ingest(server, "m", mesh);
  auto session = RawSession::open(server.request_port());
  const auto opened = session.open_mesh(1, "m");
  EXPECT_NE(opened.handle, 0U);
  EXPECT_EQ(opened.generation, mesh.directory.generation);
  EXPECT_EQ(opened.directory, mesh.directory_bytes());
  session.next_transfer();
  EXPECT_EQ(session.fetch("m"), mesh.packets);
  for (std::uint32_t id = 5; id < 7; ++id) {
    session.requests.send(proto::encode(proto::GetNextPacket{id, opened.handle}));
    const auto end = session.next_transfer();
    EXPECT_EQ(end.id, id);
    EXPECT_EQ(end.result, TransferResult::end_of_mesh);
  }
}

TEST(Session, OpeningAgainGivesTheSameHandleAndStartsAnew) {
  ServerInThread server;
  const FakeMesh mesh = fake_mesh(4, {10, 20, 30});
  ingest(server, "m", mesh);
  auto session = RawSession::open(server.request_port());
  const auto first = session.open_mesh(1, "m");
  session.next_transfer();
  session.requests.send(proto::encode(proto::GetNextPacket{2, 0}));
  EXPECT_EQ(session.next_transfer().packet, 1U);
  EXPECT_EQ(session.open_mesh(3, "m").handle, first.handle);
  EXPECT_EQ(session.next_transfer().packet, 0U);
  session.requests.send(proto::encode(proto::GetNextPacket{4, first.handle}));
  EXPECT_EQ(session.next_transfer().packet, 1U);
}

TEST(Session, HandleZeroIsTheMeshLastAskedFor) {
  ServerInThread server;
  const FakeMesh a = fake_mesh(5, {10, 20, 30});
  const FakeMesh b = fake_mesh(6, {40, 50, 60});
  ingest(server, "a", a);
  ingest(server, "b", b);
  auto session = RawSession::open(server.request_port());
  const auto handle_a = session.open_mesh(1, "a").handle;
  session.next_transfer();
  const auto handle_b = session.open_mesh(2, "b").handle;
  EXPECT_NE(handle_a, handle_b);
  session.next_transfer();
  session.requests.send(proto::encode(proto::GetNextPacket{3, 0}));
  EXPECT_EQ(session.next_transfer().bytes, b.packets[1]);
  session.requests.send(proto::encode(proto::GetNextPacket{4, handle_a}));
  EXPECT_EQ(session.next_transfer().bytes, a.packets[1]);
  session.requests.send(proto::encode(proto::GetNextPacket{5, 0}));
  EXPECT_EQ(session.next_transfer().bytes, a.packets[2]);
  session.requests.send(proto::encode(proto::GetNextPacket{6, handle_b}));
  EXPECT_EQ(session.next_transfer().bytes, b.packets[2]);
}

TEST(Session, EightRequestsMayBeOpenAndTheNinthIsRefused) {
  ServerInThread server;
  const FakeMesh mesh = fake_mesh(7, {4'000'000, 10, 20, 30, 40, 50, 60, 70});
  ingest(server, "m", mesh);
  // A small window, and nothing is read at first: so the base packet stays under way.
  auto session = RawSession::open(server.request_port(), 4096);
  session.open_mesh(1, "m");
  for (std::uint32_t id = 2; id <= 9; ++id) session.requests.send(proto::encode(proto::GetNextPacket{id, 0}));
  EXPECT_EQ(expect_error(session.requests, 9), "too_many_requests");
  session.requests.send(proto::encode(proto::Ping{77}));
  EXPECT_EQ(expect<proto::Pong>(session.requests).id, 77U);
  for (std::uint32_t id = 1; id <= 8; ++id) {
    const auto transfer = session.next_transfer();
    EXPECT_EQ(transfer.id, id);
    EXPECT_EQ(transfer.packet, id - 1);
    EXPECT_EQ(transfer.bytes, mesh.packets[id - 1]);
  }
  session.requests.send(proto::encode(proto::GetNextPacket{9, 0}));
  EXPECT_EQ(session.next_transfer().result, TransferResult::end_of_mesh);
}

TEST(Session, TwoClientsAtOnceGetTheirMeshesWhole) {
  for (const std::size_t slots : {std::size_t{1}, std::size_t{4}}) {
    ServerInThread server({}, slots);
    const std::vector<FakeMesh> meshes = {fake_mesh(8, {100, 5000, 600'000}), fake_mesh(9, {70, 300'000, 20, 10})};
    ingest(server, "0", meshes[0]);
    ingest(server, "1", meshes[1]);
    std::vector<std::thread> clients;
    for (int client = 0; client < 6; ++client) {
      clients.emplace_back([&, client] {
        auto session = RawSession::open(server.request_port());
        for (int round = 0; round < 5; ++round) {
          const int which = (client + round) % 2;
          EXPECT_EQ(session.fetch(std::to_string(which)), meshes[static_cast<std::size_t>(which)].packets);
        }
      });
    }
    for (std::thread& client : clients) client.join();
  }
}

TEST(Session, SeveralMeshesInOneSessionRunSideBySide) {
  ServerInThread server({}, 4);
  const FakeMesh a = fake_mesh(10, {500'000, 400'000});
  const FakeMesh b = fake_mesh(11, {600'000, 300'000});
  ingest(server, "a", a);
  ingest(server, "b", b);
  auto session = RawSession::open(server.request_port());
  const auto handle_a = session.open_mesh(1, "a").handle;
  const auto handle_b = session.open_mesh(2, "b").handle;
  session.requests.send(proto::encode(proto::GetNextPacket{3, handle_a}));
  session.requests.send(proto::encode(proto::GetNextPacket{4, handle_b}));
  session.requests.send(proto::encode(proto::GetMeshList{5}));
  std::map<std::uint32_t, proto::Bytes> got;
  std::vector<std::uint32_t> ends;
  for (int i = 0; i < 5; ++i) {
    auto transfer = session.next_transfer();
    EXPECT_EQ(transfer.result, TransferResult::complete);
    ends.push_back(transfer.id);
    got[transfer.id] = std::move(transfer.bytes);
  }
  EXPECT_EQ(got[1], a.packets[0]);
  EXPECT_EQ(got[2], b.packets[0]);
  EXPECT_EQ(got[3], a.packets[1]);
  EXPECT_EQ(got[4], b.packets[1]);
  EXPECT_EQ(proto::decode_mesh_page(got[5]).value().entries.size(), 2U);
  EXPECT_LT(std::find(ends.begin(), ends.end(), 1), std::find(ends.begin(), ends.end(), 3));
  EXPECT_LT(std::find(ends.begin(), ends.end(), 2), std::find(ends.begin(), ends.end(), 4));
}

/// With one slot and FIFO the transfers come one after the other in the order in which they were asked for, across
/// clients. A client that has not read yet holds the slot: so one can see that nobody behind it is served.
TEST(Session, FifoAcrossClientsWithOneSlot) {
  net::Limits limits;
  limits.stall = std::chrono::seconds(60);
  ServerInThread server(limits, 1);
  const FakeMesh mesh = fake_mesh(12, {1'000'000});
  ingest(server, "m", mesh);
  std::vector<RawSession> clients;
  for (int i = 0; i < 5; ++i) clients.push_back(RawSession::open(server.request_port(), 4096));
  const std::vector<std::size_t> order = {2, 0, 4, 3, 1};
  for (const std::size_t client : order) clients[client].open_mesh(1, "m");
  for (std::size_t turn = 0; turn < order.size(); ++turn) {
    ASSERT_TRUE(clients[order[turn]].data.stirs(kPatience)) << "turn " << turn;
    for (std::size_t later = turn + 1; later < order.size(); ++later) {
      EXPECT_FALSE(clients[order[later]].data.stirs(std::chrono::milliseconds(10))) << turn << " before " << later;
    }
    EXPECT_EQ(clients[order[turn]].next_transfer().bytes, mesh.packets[0]);
  }
}

TEST(Session, GoodbyeClosesBothChannelsWithoutAWord) {
  ServerInThread server;
  auto session = RawSession::open(server.request_port());
  session.requests.send(proto::encode(proto::Goodbye{}));
  EXPECT_FALSE(session.requests.read());
  EXPECT_FALSE(session.data.read());
}

}  // namespace
}  // namespace pmcd::test
