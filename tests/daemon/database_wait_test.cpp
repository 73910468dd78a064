// SPDX-License-Identifier: MIT
// The network loop waits for nobody: with the database busy, locked or slow, sessions are answered at once and packets
// that are in memory are served.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "daemon/store/db.h"
#include "tests/daemon/busy_thread.h"
#include "tests/daemon/bystander.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

/// A ping that waited for the database would take as long as the database was busy.
void expect_at_once(const Latencies& pings) {
  testing::Test::RecordProperty("pings", static_cast<int>(pings.sorted.size()));
  testing::Test::RecordProperty("ping_p50_us", static_cast<int>(pings.quantile(0.5) * 1000));
  testing::Test::RecordProperty("ping_p99_us", static_cast<int>(pings.quantile(0.99) * 1000));
  testing::Test::RecordProperty("ping_max_us", static_cast<int>(pings.quantile(1) * 1000));
  EXPECT_LT(pings.quantile(0.5), kSanitized ? 250 : 50);
  EXPECT_LT(pings.quantile(0.99), kSanitized ? 1'000 : 250);
}

TEST(DatabaseWait, WithBothStoreThreadsBusyCachedPacketsAreServed) {
  ServerInThread server({}, 4);
  const FakeMesh mesh = fake_mesh(1, {100, 20'000, 300'000});
  const FakeMesh cold = fake_mesh(2, {100});
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", mesh), "ok");
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("cold", cold), "ok");
  auto session = RawSession::open(server.request_port());
  EXPECT_EQ(session.fetch("m"), mesh.packets) << "and now they are in the cache";
  session.requests.send(proto::encode(proto::GetPacket{1, mesh.directory.generation, 0, 0}));
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[0]);
  auto waiting = RawSession::open(server.request_port());
  Bystander bystander(server.request_port());
  {
    const Busy reader(server.reader());
    const Busy writer(server.writer());
    waiting.requests.send(proto::encode(proto::GetBaseMesh{1, "cold"}));
    auto admin = RawAdmin::open(server.admin_socket());
    admin.connection.send(proto::encode(proto::AdminRemove{1, "no such mesh"}));
    const auto until = Clock::now() + milliseconds(1'500);
    std::uint32_t id = 2;
    while (Clock::now() < until) {
      for (std::uint32_t packet = 0; packet < mesh.packets.size(); ++packet) {
        session.requests.send(proto::encode(proto::GetPacket{id++, mesh.directory.generation, packet, 0}));
        ASSERT_EQ(session.next_transfer().bytes, mesh.packets[packet]);
      }
    }
    RecordProperty("packets_served", static_cast<int>(id - 2));
    EXPECT_GT(id, 100U);
    EXPECT_FALSE(waiting.requests.stirs(milliseconds(0))) << "the database was not asked, or not busy";
  }
  EXPECT_EQ(expect<proto::MeshOpened>(waiting.requests).id, 1U);
  EXPECT_EQ(waiting.next_transfer().bytes, cold.packets[0]);
  expect_at_once(bystander.stop());
}

TEST(DatabaseWait, WithTheDatabaseLockedAndBigUploads) {
  ServerInThread server({}, 4);
  const FakeMesh big = fake_mesh(3, {100, 30'000'000, 30'000'000});
  Bystander bystander(server.request_port());
  {
    store::Db other(server.database());
    other.execute("BEGIN IMMEDIATE");
    std::thread ingest([&] { EXPECT_EQ(RawAdmin::open(server.admin_socket()).ingest("big", big), "ok"); });
    std::this_thread::sleep_for(milliseconds(1'000));
    other.execute("ROLLBACK");
    ingest.join();
  }
  auto session = RawSession::open(server.request_port());
  EXPECT_EQ(session.fetch("big"), big.packets);
  expect_at_once(bystander.stop());
}

}  // namespace
}  // namespace pmcd::test
