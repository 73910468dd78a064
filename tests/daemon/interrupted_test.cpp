// SPDX-License-Identifier: MIT
// Transfers that a quantum interrupts, on real sockets: their packet comes whole, and is read once. Who is interrupted
// when is in tests/scheduler.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"

namespace pmcd::test {
namespace {

/// Packets of more than a quarter of the cache are not in it; two of them have room beside it, and a third has not.
TEST(Interrupted, APacketThatNoCacheTakesIsReadOnce) {
  net::Limits limits;
  limits.cache_bytes = 20'000'000;
  scheduler::Policy policy = ServerInThread::fifo(1);
  policy.quantum = std::chrono::milliseconds(1);
  ServerInThread server(limits, policy);
  const FakeMesh mesh = fake_mesh(1, {8'000'000});
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", mesh), "ok");
  std::vector<std::thread> clients;
  for (int n = 0; n < 2; ++n) {
    clients.emplace_back([&] {
      auto session = RawSession::open(server.request_port(), 65'536);
      EXPECT_EQ(session.fetch("m"), mesh.packets);
    });
  }
  for (std::thread& client : clients) client.join();
  const auto interruptions = server.ask([](net::Server& one) { return one.interruptions(); });
  EXPECT_GT(interruptions, 0U) << "it shows nothing otherwise";
  auto admin = RawAdmin::open(server.admin_socket());
  const auto status = nlohmann::json::parse(admin.answer(proto::encode(proto::AdminStatus{1})));
  EXPECT_EQ(status["cache_bytes"], 0);
  EXPECT_EQ(status["cache_misses"], 2);
}

}  // namespace
}  // namespace pmcd::test
