// SPDX-License-Identifier: MIT
// What the kernel holds for a client that reads nothing: little of its answers, and no more of packets than is soon on
// its way to a client whose speed is not known.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "proto/messages.h"
#include "tests/daemon/jam.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"
#include "tests/store/fake_mesh.h"

namespace pmcd::test {
namespace {

TEST(KernelBuffer, HoldsFewAnswersThatNobodyReadsAndLessOfPackets) {
  const net::Limits limits;
  ServerInThread server(limits, 2);
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", fake_mesh(1, {8'000'000})), "ok");
  auto silent = RawSession::open(server.request_port(), 4096, 4096);
  silent.open_mesh(1, "m");
  jam(silent.requests, proto::encode(proto::Ping{1}));
  const unsigned long answers = kernel_holds(server.request_port(), port_of(silent.requests.fd()));
  // The packet may still be on its way out of the database.
  unsigned long packets = 0;
  for (int tries = 0; tries < 50 && packets < limits.first_chunk_bytes / 4; ++tries) {
    if (tries > 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    packets = kernel_holds(server.data_port(), port_of(silent.data.fd()));
  }
  RecordProperty("answers_bytes", static_cast<int>(answers));
  RecordProperty("packets_bytes", static_cast<int>(packets));
  EXPECT_GT(answers, limits.queued_bytes / 4) << "it is not full";
  // The kernel doubles what it is asked for, and the last piece may go over it.
  EXPECT_LT(answers, 3 * limits.queued_bytes);
  EXPECT_GE(packets, limits.first_chunk_bytes / 4) << "it is not full";
  EXPECT_LT(packets, 4 * limits.first_chunk_bytes);
}

}  // namespace
}  // namespace pmcd::test
