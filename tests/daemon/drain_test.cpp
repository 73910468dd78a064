// SPDX-License-Identifier: MIT
// The end of the daemon with transfers under way: they have --drain-timeout, newcomers are told, and it is an orderly
// end either way. What systemd hears of it is in process_test.cpp.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "tests/daemon/daemon_process.h"
#include "tests/daemon/jam.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

/// What a loaded machine may add to a time.
constexpr milliseconds kSlack{2'500};

class DrainTest : public ::testing::Test {
 protected:
  /// A daemon with that option, and a client with a transfer under way of which it takes nothing yet.
  void start(const std::string& drain_timeout) {
    daemon_ =
        std::make_unique<DaemonProcess>(folder_.path(), std::vector<std::string>{"--drain-timeout", drain_timeout});
    ASSERT_EQ(RawAdmin::open(daemon_->admin_socket()).ingest("m", mesh_), "ok");
    running_ = RawSession::open(daemon_->request_port(), 4096);
    running_.open_mesh(1, "m");
    ASSERT_TRUE(running_.data.stirs(kPatience));
    idle_ = RawSession::open(daemon_->request_port());
  }

  TemporaryFolder folder_;
  const FakeMesh mesh_ = fake_mesh(1, {8'000'000});
  std::unique_ptr<DaemonProcess> daemon_;
  RawSession running_;
  RawSession idle_;
};

TEST_F(DrainTest, ATransferThatEndsInTimeIsWaitedForAndNoLonger) {
  start("30");
  auto greeted = RawConnection::tcp(daemon_->request_port());
  greeted.send(proto::encode(proto::Hello{{}, "x"}));
  const auto token = expect<proto::HelloOk>(greeted).token;
  const auto start = Clock::now();
  daemon_->signal(SIGTERM);
  for (RawSession* session : {&running_, &idle_}) {
    EXPECT_EQ(expect_notice(session->requests, proto::NoticeKind::draining).seconds, 30U);
  }
  EXPECT_EQ(expect_notice(greeted, proto::NoticeKind::draining).seconds, 30U) << "who has not joined is told too";
  auto late = RawConnection::tcp(daemon_->request_port());
  late.send(proto::encode(proto::Hello{{}, "late"}));
  EXPECT_EQ(expect_error(late, 0), "shutting_down");
  EXPECT_TRUE(late.closes());
  auto admin = RawConnection::local(daemon_->admin_socket());
  EXPECT_EQ(expect_error(admin, 0), "shutting_down");
  EXPECT_TRUE(admin.closes());
  // A standing session may ask, but nothing new begins.
  idle_.open_mesh(1, "m");
  EXPECT_FALSE(idle_.data.stirs(milliseconds(200)));
  EXPECT_EQ(running_.next_transfer().bytes, mesh_.packets[0]);
  EXPECT_EQ(expect_error(idle_.requests, 0), "shutting_down");
  EXPECT_TRUE(idle_.data.closes());
  EXPECT_EQ(expect_error(running_.requests, 0), "shutting_down");
  running_ = {};
  idle_ = {};
  greeted.close();
  EXPECT_EQ(daemon_->wait(), 0);
  const auto took = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  RecordProperty("took_ms", static_cast<int>(took.count()));
  EXPECT_LT(took, milliseconds(15'000)) << "half of the time that it might have waited";
  EXPECT_NE(daemon_->log().find("draining: 1 transfers are running, 0 requests wait"), std::string::npos);
  EXPECT_EQ(daemon_->log().find("cut off"), std::string::npos);
  EXPECT_NE(token, proto::Token{});
}

TEST_F(DrainTest, ATransferThatDoesNotIsCutOffAtThatTime) {
  start("0.7");
  const auto start = Clock::now();
  daemon_->signal(SIGTERM);
  EXPECT_EQ(expect_notice(running_.requests, proto::NoticeKind::draining).seconds, 1U) << "rounded up";
  EXPECT_EQ(expect_error(running_.requests, 0), "shutting_down");
  const auto told = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  EXPECT_EQ(daemon_->wait(), 0) << "an orderly end all the same";
  const auto took = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  RecordProperty("told_ms", static_cast<int>(told.count()));
  RecordProperty("took_ms", static_cast<int>(took.count()));
  EXPECT_GE(told, milliseconds(600));
  EXPECT_LT(told, milliseconds(700) + kSlack);
  // Connections that do not close their side are given a second more.
  EXPECT_LT(took, milliseconds(1'700) + kSlack);
  EXPECT_NE(daemon_->log().find("1 transfers did not end in time and are cut off"), std::string::npos);
  EXPECT_EQ(::access(daemon_->admin_socket().c_str(), F_OK), -1);
  EXPECT_EQ(::access((daemon_->database() + "-wal").c_str(), F_OK), -1) << "the database was closed";
}

TEST_F(DrainTest, ClientsThatTakeNoAnswersDoNotHoldItUp) {
  start("0.5");
  auto flooder = RawSession::open(daemon_->request_port(), 4096, 4096);
  jam(flooder.requests, proto::encode(proto::Ping{1}));
  const auto start = Clock::now();
  daemon_->signal(SIGTERM);
  EXPECT_EQ(daemon_->wait(), 0);
  const auto took = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  RecordProperty("took_ms", static_cast<int>(took.count()));
  EXPECT_LT(took, milliseconds(1'500) + kSlack);
}

}  // namespace
}  // namespace pmcd::test
