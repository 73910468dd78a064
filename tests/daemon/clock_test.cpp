// SPDX-License-Identifier: MIT
// The wall clock jumps while the daemon serves: it means nothing to time-outs and transfers. libfaketime gives the
// daemon a wall clock that follows a file; its monotonic clock stays the kernel's.
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/daemon/daemon_process.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;

std::string library() {
  for (const auto& folder : std::filesystem::directory_iterator("/usr/lib")) {
    const auto path = folder.path() / "faketime" / "libfaketimeMT.so.1";
    if (std::filesystem::exists(path)) return path;
  }
  return {};
}

/// The year of the last line of a log.
int year_of_last_line(const DaemonProcess& daemon) {
  const std::string log = daemon.log();
  const std::size_t end = log.rfind('\n');
  const std::size_t start = log.rfind('\n', end - 1);
  return std::stoi(log.substr(start == std::string::npos ? 0 : start + 1, 4));
}

TEST(ClockJumps, NothingTimesOutAndTheFetchGoesOn) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer must be the first library, and so must libfaketime";
  const std::string faketime = library();
  ASSERT_NE(faketime, "") << "the package faketime is not installed";
  const TemporaryFolder folder;
  const std::string offset = folder.file("offset");
  // Renamed into its place: the daemon looks at it at every look at the clock.
  const auto jump_to = [&](const char* days) {
    std::ofstream(offset + ".new") << days;
    std::filesystem::rename(offset + ".new", offset);
  };
  jump_to("+0d");
  DaemonProcess daemon(folder.path(), {"--stall-timeout", "5", "--join-timeout", "20", "--grace-time", "5"}, [&] {
    ::setenv("LD_PRELOAD", faketime.c_str(), 1);
    ::setenv("FAKETIME_TIMESTAMP_FILE", offset.c_str(), 1);
    ::setenv("FAKETIME_NO_CACHE", "1", 1);
    ::setenv("DONT_FAKE_MONOTONIC", "1", 1);
  });
  const FakeMesh mesh = fake_mesh(1, {2'000'000, 300, 1'000'000});
  ASSERT_EQ(RawAdmin::open(daemon.admin_socket()).ingest("m", mesh), "ok");
  const int year = year_of_last_line(daemon);

  auto greeted = RawConnection::tcp(daemon.request_port());
  greeted.send(proto::encode(proto::Hello{{}, "waits to join"}));
  const auto hello = expect<proto::HelloOk>(greeted);
  auto silent = RawConnection::tcp(daemon.request_port());
  auto session = RawSession::open(daemon.request_port(), 4096);
  session.open_mesh(1, "m");
  ASSERT_TRUE(session.data.stirs(kPatience));
  for (const auto& [days, expected] : {std::pair{"+400d", year + 1}, {"-400d", year - 2}, {"+0d", year}}) {
    jump_to(days);
    // Something that is logged, to see that the daemon's clock did jump.
    auto witness = RawSession::open(daemon.request_port());
    EXPECT_NEAR(year_of_last_line(daemon), expected, 1) << days;
    if (expected != year) {
      EXPECT_NE(year_of_last_line(daemon), year) << days;
    }
    // Long enough for the daemon to look at its clocks: it judges the pace of a transfer every 250 ms.
    std::this_thread::sleep_for(milliseconds(600));
  }
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[0]);
  jump_to("+400d");
  session.requests.send(proto::encode(proto::GetNextPacket{2, 0}));
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[1]);
  // A mesh in its grace time is still there a year later, and the newcomers' time is not over either.
  ASSERT_EQ(RawAdmin::open(daemon.admin_socket()).ingest("m", fake_mesh(2, {10}), true), "replaced");
  jump_to("+800d");
  session.requests.send(proto::encode(proto::GetNextPacket{3, 0}));
  EXPECT_EQ(session.next_transfer().bytes, mesh.packets[2]);
  auto data = RawConnection::tcp(hello.data_port);
  data.send(proto::encode(proto::Join{{}, hello.token}));
  expect<proto::JoinOk>(data);
  silent.send(proto::encode(proto::Hello{{}, "says something at last"}));
  expect<proto::HelloOk>(silent);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

}  // namespace
}  // namespace pmcd::test
