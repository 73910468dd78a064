// SPDX-License-Identifier: MIT
// Requests that are taken back while the store reads for them: the slot is free at once, the read is not, so what a
// client can make the store do for nobody is bounded by the slots, and the others do not wait behind it.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/mesh_list.h"
#include "proto/messages.h"
#include "tests/daemon/busy_thread.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"
#include "tests/store/fake_mesh.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kSteps = 300;

net::Limits without_cache() {
  net::Limits limits;
  limits.cache_bytes = 0;
  return limits;
}

/// In one piece, so that the ping does not wait for the acknowledgement of the request.
proto::Bytes with_ping(proto::Bytes request, std::uint32_t id) {
  const proto::Bytes ping = proto::encode(proto::Ping{id});
  request.insert(request.end(), ping.begin(), ping.end());
  return request;
}

/// Lets the store go on, and the server only when what was put into the queue for counting is out again.
void release(ServerInThread& server, std::unique_ptr<Busy>& busy) {
  server.ask([&busy](net::Server&) {
    busy.reset();
    return true;
  });
}

struct Storm {
  std::string what;
  std::size_t slots = 0;
  std::size_t most_reads = 0;  ///< that the store is asked for, whatever the client does
  bool lists = false;          ///< else packets
};

class CancelStormTest : public testing::TestWithParam<Storm> {
 protected:
  CancelStormTest()
      : server_(without_cache(), GetParam().slots), mesh_(fake_mesh(1, std::vector<std::size_t>(kSteps))) {
    EXPECT_EQ(RawAdmin::open(server_.admin_socket()).ingest("many packets", mesh_), "ok");
  }

  /// A list with a filter is not kept by the daemon, and no packet is asked for twice: each is a read of its own.
  [[nodiscard]] proto::Bytes request(std::uint32_t step) const {
    if (GetParam().lists) return proto::encode(proto::GetMeshList{step + 1, "many", "", 0});
    return proto::encode(proto::GetPacket{step + 1, mesh_.directory.generation, step, 0});
  }

  ServerInThread server_;
  const FakeMesh mesh_;
};

TEST_P(CancelStormTest, LeavesTheStoreAFewReadsAndTheOthersAreServed) {
  auto stormer = RawSession::open(server_.request_port());
  auto other = RawSession::open(server_.request_port());
  for (RawSession* session : {&stormer, &other}) {
    session->open_mesh(1'000, "many packets");
    ASSERT_EQ(session->next_transfer().bytes, mesh_.packets[0]);
  }
  const int on = 1;
  ::setsockopt(stormer.requests.fd(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  auto busy = std::make_unique<Busy>(server_.reader());
  for (std::uint32_t step = 0; step < kSteps; ++step) {
    // The answer to the ping shows that the request has had its turn.
    stormer.requests.send(with_ping(request(step), step));
    ASSERT_EQ(expect<proto::Pong>(stormer.requests).id, step);
    stormer.requests.send(proto::encode(proto::Cancel{step + 1}));
    const RawTransfer cancelled = stormer.next_transfer();
    ASSERT_EQ(cancelled.id, step + 1);
    ASSERT_EQ(cancelled.result, proto::TransferResult::cancelled);
  }
  other.requests.send(proto::encode(proto::GetMeshList{1, "many", "", 0}));
  other.requests.send(proto::encode(proto::GetNextPacket{2, 0}));
  other.requests.send(proto::encode(proto::Ping{3}));
  EXPECT_EQ(expect<proto::Pong>(other.requests).id, 3U);
  EXPECT_FALSE(other.data.stirs(milliseconds(0)));
  EXPECT_EQ(busy->fill_and_count(), GetParam().most_reads);
  release(server_, busy);
  std::map<std::uint32_t, proto::Bytes> answers;
  for (int i = 0; i < 2; ++i) {
    RawTransfer transfer = other.next_transfer();
    answers[transfer.id] = std::move(transfer.bytes);
  }
  const auto list = proto::decode_mesh_page(answers[1]);
  ASSERT_TRUE(list.ok());
  EXPECT_EQ(list.value().matches, 1U);
  EXPECT_EQ(answers[2], mesh_.packets[1]);
  // Nor has the client lost anything by it.
  for (std::uint32_t step = 0; step < 10; ++step) {
    stormer.requests.send(request(step));
    const RawTransfer transfer = stormer.next_transfer();
    EXPECT_EQ(transfer.id, step + 1);
    EXPECT_EQ(transfer.result, proto::TransferResult::complete);
  }
}

// At 32 slots Dispatcher's kMostAbandoned is what bounds it.
INSTANTIATE_TEST_SUITE_P(Dispatcher, CancelStormTest,
                         testing::Values(Storm{"ListsOneSlot", 1, 1, true}, Storm{"ListsFourSlots", 4, 4, true},
                                         Storm{"ListsManySlots", 32, 16, true}, Storm{"PacketsFourSlots", 4, 4, false},
                                         Storm{"PacketsManySlots", 32, 16, false}),
                         [](const auto& param) { return param.param.what; });

TEST(CancelStorm, OfSessionsThatLeaveIsBoundedLikewise) {
  for (const auto& [slots, most_reads] : {std::pair<std::size_t, std::size_t>{1, 1}, {4, 4}, {32, 16}}) {
    ServerInThread server({}, slots);
    ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", fake_mesh(1, {100})), "ok");
    auto busy = std::make_unique<Busy>(server.reader());
    for (std::size_t i = 0; i < 3 * most_reads; ++i) {
      auto leaver = RawSession::open(server.request_port());
      leaver.requests.send(with_ping(proto::encode(proto::GetMeshList{1, "m", "", 0}), 2));
      ASSERT_EQ(expect<proto::Pong>(leaver.requests).id, 2U);
    }
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (server.sessions() > 0 && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    ASSERT_EQ(server.sessions(), 0U);
    EXPECT_EQ(busy->fill_and_count(), most_reads) << slots << " slots";
    release(server, busy);
    auto other = RawSession::open(server.request_port());
    other.requests.send(proto::encode(proto::GetMeshList{1, "m", "", 0}));
    EXPECT_EQ(proto::decode_mesh_page(other.next_transfer().bytes).value().matches, 1U);
  }
}

}  // namespace
}  // namespace pmcd::test
