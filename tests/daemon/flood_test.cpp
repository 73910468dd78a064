// SPDX-License-Identifier: MIT
// Clients that send as fast as they can and read nothing: the daemon's memory stays bounded, who does not take its
// answers is dropped, and everybody else is served meanwhile.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "tests/daemon/bystander.h"
#include "tests/daemon/daemon_process.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

enum class Flooded { dropped, still_there };
/// either: how fast the daemon works it off, and so whether its answers fill all buffers in time, is the database's
/// pace.
enum class Expected { dropped, still_there, either };

/// Sends `frame` over and over, at least `least` times, until the connection breaks or `time` is over.
Flooded flood(int fd, const proto::Bytes& frame, std::size_t least, milliseconds time, std::size_t& sent) {
  ::fcntl(fd, F_SETFL, O_NONBLOCK);
  proto::Bytes block;
  for (int i = 0; i < 1'000; ++i) block.insert(block.end(), frame.begin(), frame.end());
  const auto start = Clock::now();
  std::size_t bytes = 0;
  while (Clock::now() - start < time || (sent < least && Clock::now() - start < kPatience)) {
    const std::size_t at = bytes % block.size();
    const ssize_t count = ::send(fd, block.data() + at, block.size() - at, MSG_NOSIGNAL);
    if (count > 0) {
      bytes += static_cast<std::size_t>(count);
      sent = bytes / frame.size();
    } else if (errno != EAGAIN) {
      return Flooded::dropped;
    } else {
      std::this_thread::sleep_for(milliseconds(1));
    }
  }
  return Flooded::still_there;
}

struct Flood {
  std::string what;
  proto::Bytes frame;
  Expected expected = Expected::dropped;
  bool on_data = false;
  std::size_t sent = 0;
  Flooded end = Flooded::still_there;
};

TEST(Flood, IsBoundedAndTheOthersAreServed) {
  const TemporaryFolder folder;
  DaemonProcess daemon(folder.path(), {"--stall-timeout", "0.8"});
  const FakeMesh mesh = fake_mesh(1, {100, 20'000});
  ASSERT_EQ(RawAdmin::open(daemon.admin_socket()).ingest("m", mesh), "ok");
  const auto unknown = static_cast<proto::FrameType>(0x6000);
  std::vector<Flood> floods = {
      {"ping", proto::encode(proto::Ping{1})},
      {"get_next_packet", proto::encode(proto::GetNextPacket{1, 0})},
      {"get_base_mesh", proto::encode(proto::GetBaseMesh{1, "no such mesh"}), Expected::either},
      {"unknown type", proto::make_frame(unknown, proto::Bytes(4))},
      {"the largest unknown frame", proto::make_frame(unknown, proto::Bytes(proto::kMaxClientFrame - 2))},
      {"cancel, which has no answer", proto::encode(proto::Cancel{1}), Expected::still_there},
      {"unknown type on the data channel", proto::make_frame(unknown, proto::Bytes(4)), Expected::dropped, true},
  };
  Bystander bystander(daemon.request_port());
  const std::size_t before = resident_kib(daemon.id());
  std::vector<RawSession> sessions;
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < floods.size(); ++i) {
    auto& session = sessions.emplace_back();
    session.requests = RawConnection::tcp(daemon.request_port(), 4096);
    session.requests.send(proto::encode(proto::Hello{{}, floods[i].what}));
    const auto hello = expect<proto::HelloOk>(session.requests);
    session.data = RawConnection::tcp(hello.data_port, 4096);
    session.data.send(proto::encode(proto::Join{{}, hello.token}));
    expect<proto::JoinOk>(session.data);
  }
  const auto start = Clock::now();
  for (std::size_t i = 0; i < floods.size(); ++i) {
    threads.emplace_back([&flood_of = floods[i], &session = sessions[i]] {
      const int fd = flood_of.on_data ? session.data.fd() : session.requests.fd();
      const milliseconds time = flood_of.expected == Expected::dropped ? kPatience : milliseconds(1'500);
      flood_of.end = flood(fd, flood_of.frame, 100'000, time, flood_of.sent);
    });
  }
  std::atomic<bool> over = false;
  std::size_t most = before;
  std::thread watch([&] {
    while (!over) {
      most = std::max(most, resident_kib(daemon.id()));
      std::this_thread::sleep_for(milliseconds(10));
    }
  });
  auto fetcher = RawSession::open(daemon.request_port());
  EXPECT_EQ(fetcher.fetch("m"), mesh.packets);
  for (std::thread& thread : threads) thread.join();
  const auto took = Clock::now() - start;
  over = true;
  watch.join();
  const Latencies pings = bystander.stop();

  for (const Flood& one : floods) {
    RecordProperty(one.what + " sent", static_cast<int>(one.sent));
    // With sanitizers the daemon may not have come through the flood when the patience of the test is over.
    if (kSanitized && one.end != Flooded::dropped) continue;
    if (one.end == Flooded::still_there) {
      EXPECT_GE(one.sent, 100'000U) << one.what;
    }
    if (one.expected == Expected::either) continue;
    EXPECT_EQ(one.end == Flooded::dropped, one.expected == Expected::dropped) << one.what << ", " << one.sent;
  }
  RecordProperty("ms", static_cast<int>(std::chrono::duration_cast<milliseconds>(took).count()));
  RecordProperty("before_kib", static_cast<int>(before));
  RecordProperty("most_kib", static_cast<int>(most));
  RecordProperty("ping_p50_us", static_cast<int>(pings.quantile(0.5) * 1000));
  RecordProperty("ping_p99_us", static_cast<int>(pings.quantile(0.99) * 1000));
  RecordProperty("ping_max_us", static_cast<int>(pings.quantile(1) * 1000));
  if (!kSanitized) {
    EXPECT_LT(most - before, 8 * 1024U) << "KiB for seven floods";
  }
  EXPECT_LT(pings.quantile(0.5), 250);
  EXPECT_LT(pings.quantile(1), 2'500);

  // What nobody reads is not kept by the kernel either once its session is dropped.
  const auto deadline = Clock::now() + kPatience;
  for (std::size_t i = 0; i < floods.size(); ++i) {
    if (floods[i].end != Flooded::dropped) continue;
    const std::uint16_t port = port_of(sessions[i].requests.fd());
    while (kernel_holds(daemon.request_port(), port) > 0 && Clock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds(10));
    }
    EXPECT_EQ(kernel_holds(daemon.request_port(), port), 0U) << floods[i].what;
  }
  fetcher.requests.send(proto::encode(proto::Ping{9}));
  EXPECT_EQ(expect<proto::Pong>(fetcher.requests).id, 9U);
}

}  // namespace
}  // namespace pmcd::test
