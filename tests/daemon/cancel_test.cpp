// SPDX-License-Identifier: MIT
// cancel and get_packet against a whole server over real sockets: requests that wait, run, have ended; a packet taken
// up again at any byte, in the same and in another session.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "proto/mesh_list.h"
#include "proto/messages.h"
#include "tests/daemon/busy_thread.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"
#include "tests/store/fake_mesh.h"

namespace pmcd::test {
namespace {

using proto::TransferResult;

class CancelTest : public testing::Test {
 protected:
  void ingest(const std::string& name, const FakeMesh& mesh) {
    ASSERT_EQ(RawAdmin::open(server_.admin_socket()).ingest(name, mesh), "ok");
  }
  RawSession session(int receive_buffer = 0) { return RawSession::open(server_.request_port(), receive_buffer); }

  ServerInThread server_;
};

proto::Bytes tail_of(const proto::Bytes& packet, std::uint64_t offset) {
  return {packet.begin() + static_cast<std::ptrdiff_t>(offset), packet.end()};
}

/// The next transfer_end, whatever chunks come before; how many bytes they had is added to `bytes`.
proto::TransferEnd next_end(RawSession& session, std::uint64_t& bytes) {
  while (const auto frame = session.data.read()) {
    if (frame->is(proto::FrameType::transfer_end)) return proto::decode<proto::TransferEnd>(frame->body).value();
    bytes += proto::decode_chunk(frame->body).value().bytes.size();
  }
  ADD_FAILURE() << "the data channel ended";
  return {};
}

TEST_F(CancelTest, ARunningTransferEndsBehindItsLastChunkAndThePlaceStays) {
  const FakeMesh mesh = fake_mesh(1, {100, 8'000'000, 300});
  ingest("m", mesh);
  auto client = session(4096);
  const auto opened = client.open_mesh(1, "m");
  EXPECT_EQ(client.next_transfer().bytes, mesh.packets[0]);
  client.requests.send(proto::encode(proto::GetNextPacket{2, opened.handle}));
  ASSERT_TRUE(client.data.stirs(kPatience));
  client.requests.send(proto::encode(proto::Cancel{2}));
  std::uint64_t bytes = 0;
  const auto end = next_end(client, bytes);
  EXPECT_EQ(end.id, 2U);
  EXPECT_EQ(end.result, TransferResult::cancelled);
  EXPECT_GT(bytes, 0U);
  EXPECT_LT(bytes, mesh.packets[1].size()) << "it was cut off";
  client.requests.send(proto::encode(proto::GetNextPacket{2, opened.handle}));
  const auto again = client.next_transfer();
  EXPECT_EQ(again.packet, 1U) << "the place did not move, and the id was free again";
  EXPECT_EQ(again.bytes, mesh.packets[1]);
}

TEST_F(CancelTest, WaitingRequestsEndAtOnceWithoutAChunk) {
  const FakeMesh big = fake_mesh(2, {8'000'000, 50});
  const FakeMesh small = fake_mesh(3, {100, 200});
  ingest("big", big);
  ingest("small", small);
  auto client = session(4096);
  const auto handle = client.open_mesh(1, "big").handle;
  ASSERT_TRUE(client.data.stirs(kPatience));
  // One waits for the slot, one in the line of its mesh, and a list waits for the slot too.
  client.open_mesh(2, "small");
  client.requests.send(proto::encode(proto::GetNextPacket{3, handle}));
  client.requests.send(proto::encode(proto::GetMeshList{4}));
  for (const std::uint32_t id : {2U, 3U, 4U}) client.requests.send(proto::encode(proto::Cancel{id}));
  // The big one goes on as soon as its data is read: not before the cancels have come.
  client.requests.send(proto::encode(proto::Ping{5}));
  EXPECT_EQ(expect<proto::Pong>(client.requests).id, 5U);
  std::vector<std::uint32_t> cancelled;
  std::uint64_t bytes = 0;
  for (int i = 0; i < 3; ++i) {
    const auto end = next_end(client, bytes);
    EXPECT_EQ(end.result, TransferResult::cancelled);
    cancelled.push_back(end.id);
  }
  EXPECT_EQ(cancelled, (std::vector<std::uint32_t>{2, 3, 4}));
  const auto end = next_end(client, bytes);
  EXPECT_EQ(end.id, 1U);
  EXPECT_EQ(end.result, TransferResult::complete) << "the one that ran goes on";
  EXPECT_EQ(bytes, big.packets[0].size());
  client.requests.send(proto::encode(proto::GetNextPacket{5, handle}));
  EXPECT_EQ(client.next_transfer().bytes, big.packets[1]);
}

TEST_F(CancelTest, AnOpeningAnewThatIsCancelledWhileItWaitsLeavesThePlace) {
  const FakeMesh big = fake_mesh(2, {8'000'000});
  const FakeMesh mesh = fake_mesh(3, {100, 200, 300});
  ingest("big", big);
  ingest("m", mesh);
  auto client = session();
  const auto handle = client.open_mesh(1, "m").handle;
  client.next_transfer();
  client.requests.send(proto::encode(proto::GetNextPacket{2, handle}));
  EXPECT_EQ(client.next_transfer().packet, 1U);
  auto holder = session(4096);
  holder.open_mesh(1, "big");
  ASSERT_TRUE(holder.data.stirs(kPatience)) << "it has the only slot";
  EXPECT_EQ(client.open_mesh(3, "m").handle, handle);
  client.requests.send(proto::encode(proto::Cancel{3}));
  std::uint64_t bytes = 0;
  EXPECT_EQ(next_end(client, bytes).result, TransferResult::cancelled);
  EXPECT_EQ(bytes, 0U);
  holder.requests.send(proto::encode(proto::Goodbye{}));
  client.requests.send(proto::encode(proto::GetNextPacket{4, handle}));
  EXPECT_EQ(client.next_transfer().packet, 2U);
}

TEST_F(CancelTest, WhatIsNotOpenIsIgnored) {
  const FakeMesh mesh = fake_mesh(4, {100, 200});
  ingest("m", mesh);
  auto client = session();
  client.requests.send(proto::encode(proto::Cancel{77}));
  const auto handle = client.open_mesh(1, "m").handle;
  EXPECT_EQ(client.next_transfer().bytes, mesh.packets[0]);
  client.requests.send(proto::encode(proto::Cancel{1}));
  client.requests.send(proto::encode(proto::GetNextPacket{2, handle}));
  const auto transfer = client.next_transfer();
  EXPECT_EQ(transfer.id, 2U) << "nothing came for the cancels";
  EXPECT_EQ(transfer.bytes, mesh.packets[1]);
  client.requests.send(proto::encode(proto::Ping{9}));
  EXPECT_EQ(expect<proto::Pong>(client.requests).id, 9U);
}

TEST_F(CancelTest, TheSlotOfACancelledTransferGoesToTheNext) {
  const FakeMesh mesh = fake_mesh(5, {8'000'000});
  ingest("m", mesh);
  auto slow = session(4096);
  slow.open_mesh(1, "m");
  ASSERT_TRUE(slow.data.stirs(kPatience));
  auto other = session();
  other.open_mesh(1, "m");
  EXPECT_FALSE(other.data.stirs(std::chrono::milliseconds(200))) << "there is one slot";
  slow.requests.send(proto::encode(proto::Cancel{1}));
  std::uint64_t bytes = 0;
  EXPECT_EQ(next_end(slow, bytes).result, TransferResult::cancelled);
  EXPECT_EQ(other.next_transfer().bytes, mesh.packets[0]);
}

TEST_F(CancelTest, GetPacketBringsAnyPacketFromAnyByte) {
  const FakeMesh mesh = fake_mesh(6, {100, 70'000, 300});
  ingest("m", mesh);
  const std::uint64_t generation = mesh.directory.generation;
  auto client = session();
  const auto handle = client.open_mesh(1, "m").handle;
  client.next_transfer();
  for (const std::uint64_t offset : {0U, 1U, 40'000U, 69'999U + 0U}) {
    client.requests.send(proto::encode(proto::GetPacket{2, generation, 1, offset}));
    const auto frame = client.data.read();
    ASSERT_TRUE(frame && frame->is(proto::FrameType::chunk));
    const auto first = proto::decode_chunk(frame->body).value();
    EXPECT_EQ(first.header.handle, handle) << "the session has this content open";
    EXPECT_EQ(first.header.packet, 1U);
    EXPECT_EQ(first.header.offset, offset);
    EXPECT_EQ(first.header.total, mesh.packets[1].size());
    proto::Bytes bytes(first.bytes.begin(), first.bytes.end());
    while (const auto next = client.data.read()) {
      if (next->is(proto::FrameType::transfer_end)) break;
      const auto chunk = proto::decode_chunk(next->body).value();
      EXPECT_EQ(chunk.header.offset, offset + bytes.size());
      bytes.insert(bytes.end(), chunk.bytes.begin(), chunk.bytes.end());
    }
    EXPECT_EQ(bytes, tail_of(mesh.packets[1], offset));
  }
  client.requests.send(proto::encode(proto::GetNextPacket{3, handle}));
  EXPECT_EQ(client.next_transfer().packet, 2U) << "the place is behind what get_packet brought";
}

TEST_F(CancelTest, AnotherSessionGoesOnWhereTheFirstWasCutOff) {
  const FakeMesh mesh = fake_mesh(7, {100, 70'000, 300});
  ingest("m", mesh);
  auto client = session();
  client.requests.send(proto::encode(proto::GetPacket{8, mesh.directory.generation, 1, 65'000}));
  const auto opened = expect<proto::MeshOpened>(client.requests);
  EXPECT_EQ(opened.id, 8U);
  EXPECT_EQ(opened.generation, mesh.directory.generation);
  EXPECT_EQ(opened.directory, codec::serialize(mesh.directory));
  std::uint64_t bytes = 0;
  EXPECT_EQ(next_end(client, bytes).result, TransferResult::complete);
  EXPECT_EQ(bytes, mesh.packets[1].size() - 65'000);
  client.requests.send(proto::encode(proto::GetNextPacket{9, 0}));
  const auto last = client.next_transfer();
  EXPECT_EQ(last.handle, opened.handle);
  EXPECT_EQ(last.bytes, mesh.packets[2]);
}

TEST_F(CancelTest, ACancelledGetPacketLeavesThePlaceWhereItWas) {
  const FakeMesh mesh = fake_mesh(8, {100, 200, 8'000'000});
  ingest("m", mesh);
  auto client = session(4096);
  const auto handle = client.open_mesh(1, "m").handle;
  client.next_transfer();
  client.requests.send(proto::encode(proto::GetPacket{2, mesh.directory.generation, 2, 1'000'000}));
  ASSERT_TRUE(client.data.stirs(kPatience));
  client.requests.send(proto::encode(proto::Cancel{2}));
  std::uint64_t bytes = 0;
  EXPECT_EQ(next_end(client, bytes).result, TransferResult::cancelled);
  client.requests.send(proto::encode(proto::GetNextPacket{3, handle}));
  EXPECT_EQ(client.next_transfer().packet, 1U);
}

TEST_F(CancelTest, BeyondTheEndIsBadRangeAndAnUnknownContentMeshChanged) {
  const FakeMesh mesh = fake_mesh(9, {100, 200});
  ingest("m", mesh);
  const std::uint64_t generation = mesh.directory.generation;
  const std::uint64_t size = mesh.packets[1].size();
  auto client = session();
  client.requests.send(proto::encode(proto::GetPacket{1, generation, 2, 0}));
  EXPECT_EQ(expect_error(client.requests, 1), "bad_range");
  client.requests.send(proto::encode(proto::GetPacket{2, generation, 1, size}));
  EXPECT_EQ(expect_error(client.requests, 2), "bad_range");
  client.requests.send(proto::encode(proto::GetPacket{3, generation, 0xffffffff, ~std::uint64_t{0}}));
  EXPECT_EQ(expect_error(client.requests, 3), "bad_range");
  client.requests.send(proto::encode(proto::GetPacket{4, generation + 1, 0, 0}));
  EXPECT_EQ(expect_error(client.requests, 4), "mesh_changed");
  client.requests.send(proto::encode(proto::GetPacket{5, generation, 1, size - 1}));
  expect<proto::MeshOpened>(client.requests);
  std::uint64_t bytes = 0;
  EXPECT_EQ(next_end(client, bytes).result, TransferResult::complete);
  EXPECT_EQ(bytes, 1U);
  RawAdmin::open(server_.admin_socket()).answer(proto::encode(proto::AdminRemove{1, "m"}));
  expect_notice(client.requests, proto::NoticeKind::mesh_retired);
  client.requests.send(proto::encode(proto::GetPacket{6, generation, 0, 0}));
  bytes = 0;
  EXPECT_EQ(next_end(client, bytes).result, TransferResult::complete) << "who has a handle goes on";
  EXPECT_EQ(bytes, mesh.packets[0].size());
}

TEST_F(CancelTest, ARefusedRangeOfAMeshThatIsNotOpenCostsTheDatabaseOneRead) {
  const FakeMesh mesh = fake_mesh(9, std::vector<std::size_t>(500));
  ingest("m", mesh);
  auto client = session();
  client.requests.send(proto::encode(proto::GetPacket{1, mesh.directory.generation, 5'000, 0}));
  EXPECT_EQ(expect_error(client.requests, 1), "bad_range");
  auto busy = std::make_unique<Busy>(server_.reader());
  for (std::uint32_t id = 2; id < 50; ++id) {
    client.requests.send(proto::encode(proto::GetPacket{id, mesh.directory.generation, 5'000, 0}));
  }
  client.requests.send(proto::encode(proto::Ping{50}));
  const bool answered = client.requests.stirs(kPatience);
  EXPECT_EQ(busy->fill_and_count(), 0U);
  server_.ask([&busy](net::Server&) {
    busy.reset();
    return true;
  });
  ASSERT_TRUE(answered);
  for (std::uint32_t id = 2; id < 50; ++id) EXPECT_EQ(expect_error(client.requests, id), "bad_range");
  EXPECT_EQ(expect<proto::Pong>(client.requests).id, 50U);
}

TEST_F(CancelTest, ThePagesOfTheListAreCutAndFiltered) {
  for (const char* name : {"Bunny", "bun", "cube", "bunny 2"}) ingest(name, fake_mesh(10, {50}));
  auto client = session();
  const auto page = [&](const proto::GetMeshList& request) {
    client.requests.send(proto::encode(request));
    return proto::decode_mesh_page(client.next_transfer().bytes).value();
  };
  const auto first = page({1, "bun", "", 2});
  EXPECT_EQ(first.matches, 3U);
  EXPECT_EQ(first.remaining, 1U);
  ASSERT_EQ(first.entries.size(), 2U);
  EXPECT_EQ(first.entries[0].name, "Bunny");
  EXPECT_EQ(first.entries[1].name, "bun");
  const auto second = page({2, "bun", "bun", 2});
  EXPECT_EQ(second.matches, 3U);
  EXPECT_EQ(second.remaining, 0U);
  ASSERT_EQ(second.entries.size(), 1U);
  EXPECT_EQ(second.entries[0].name, "bunny 2");
  EXPECT_EQ(page({3, "", "zzz", 0}).entries.size(), 0U);
  EXPECT_EQ(page({4, "none of this", "", 0}).matches, 0U);
}

}  // namespace
}  // namespace pmcd::test
