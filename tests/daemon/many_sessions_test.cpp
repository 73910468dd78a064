// SPDX-License-Identifier: MIT
// Nine thousand sessions at once in one daemon: what each of them costs, that a busy one among them is served as ever,
// and that one more is refused.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/daemon/bystander.h"
#include "tests/daemon/daemon_process.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// Descriptors that the daemon wants beside those of its sessions. This test, which has the same limit, needs fewer.
constexpr std::size_t kSetAside = 384;

/// Raises the limit of descriptors as far as it goes; how many it is.
std::size_t most_descriptors() {
  rlimit limit{};
  ::getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
  return limit.rlim_cur;
}

/// Two sockets and nothing else, where a RawSession has buffers.
class IdleSession {
 public:
  explicit IdleSession(std::uint16_t request_port) : requests_(connect(request_port)) {
    send(requests_, proto::encode(proto::Hello{{}, "idle"}));
    proto::Bytes answer = receive(requests_);
    const auto hello = proto::decode<proto::HelloOk>(answer);
    if (!hello) return;
    data_ = connect(hello.value().data_port);
    send(data_, proto::encode(proto::Join{{}, hello.value().token}));
    joined_ = receive(data_).size() == proto::encode(proto::JoinOk{}).size() - proto::kFrameHeaderBytes;
  }
  IdleSession(IdleSession&& other) noexcept { *this = std::move(other); }
  IdleSession& operator=(IdleSession&& other) noexcept {
    std::swap(requests_, other.requests_);
    std::swap(data_, other.data_);
    std::swap(joined_, other.joined_);
    return *this;
  }
  IdleSession(const IdleSession&) = delete;
  IdleSession& operator=(const IdleSession&) = delete;
  ~IdleSession() {
    for (const int fd : {requests_, data_}) {
      if (fd >= 0) ::close(fd);
    }
  }
  [[nodiscard]] bool joined() const { return joined_; }

 private:
  static int connect(std::uint16_t port) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{10, 0};
    ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    static_cast<void>(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address));
    return fd;
  }
  static void send(int fd, const proto::Bytes& frame) {
    static_cast<void>(::send(fd, frame.data(), frame.size(), MSG_NOSIGNAL));
  }
  /// The body of the one frame that comes; it is short enough to come whole.
  static proto::Bytes receive(int fd) {
    proto::Bytes frame(512);
    const ssize_t count = ::recv(fd, frame.data(), frame.size(), 0);
    if (count < static_cast<ssize_t>(proto::kFrameHeaderBytes)) return {};
    frame.resize(static_cast<std::size_t>(count));
    frame.erase(frame.begin(), frame.begin() + proto::kFrameHeaderBytes);
    return frame;
  }

  int requests_ = -1;
  int data_ = -1;
  bool joined_ = false;
};

std::string status_of(const DaemonProcess& daemon) {
  return RawAdmin::open(daemon.admin_socket()).answer(proto::encode(proto::AdminStatus{1}));
}

bool sessions_become(const DaemonProcess& daemon, std::size_t wanted) {
  const std::string field = "\"sessions\":" + std::to_string(wanted) + ",";
  const auto deadline = Clock::now() + 2 * kPatience;
  while (status_of(daemon).find(field) == std::string::npos) {
    if (Clock::now() >= deadline) return false;
    std::this_thread::sleep_for(milliseconds(20));
  }
  return true;
}

TEST(ManySessions, NineThousandIdleOnesAndABusyOne) {
  constexpr std::size_t count = kSanitized ? 600 : 9'000;
  if (const std::size_t most = most_descriptors(); most < 2 * count + kSetAside) {
    GTEST_SKIP() << "a process may have " << most << " descriptors here, too few for " << count << " sessions";
  }
  const TemporaryFolder folder;
  const std::string most = std::to_string(count);
  DaemonProcess daemon(folder.path(), {"--max-sessions", most, "--max-sessions-per-address", most});
  const FakeMesh mesh = fake_mesh(1, {100, 20'000, 300'000});
  ASSERT_EQ(RawAdmin::open(daemon.admin_socket()).ingest("m", mesh), "ok");
  auto busy = RawSession::open(daemon.request_port());
  EXPECT_EQ(busy.fetch("m"), mesh.packets);
  const std::size_t idle = count - 2;
  std::vector<IdleSession> sessions;
  sessions.reserve(idle);
  std::size_t resident = 0;
  for (int round = 0; round < 2; ++round) {
    const std::size_t before = resident_kib(daemon.id());
    const auto start = Clock::now();
    // The second time fewer will do, to see that the memory of those who left is used again.
    while (sessions.size() < (round == 0 ? idle : idle / 4)) {
      sessions.emplace_back(daemon.request_port());
      ASSERT_TRUE(sessions.back().joined()) << "session " << sessions.size() << "\n" << daemon.log().substr(0, 2'000);
    }
    const auto took = std::chrono::duration_cast<milliseconds>(Clock::now() - start).count();
    const std::size_t after = resident_kib(daemon.id());
    const std::string suffix = round == 0 ? "" : "_again";
    RecordProperty("set_up_ms" + suffix, static_cast<int>(took));
    RecordProperty("before_kib" + suffix, static_cast<int>(before));
    RecordProperty("after_kib" + suffix, static_cast<int>(after));
    if (round == 0) {
      if (!kSanitized) {
        EXPECT_LT(after - before, 16 * idle) << "KiB for " << idle << " sessions";
      }
      resident = after;
      Bystander bystander(daemon.request_port());
      auto over = RawConnection::tcp(daemon.request_port());
      EXPECT_EQ(expect_error(over, 0), "too_many_sessions");
      EXPECT_NE(status_of(daemon).find("\"sessions\":" + most + ","), std::string::npos);
      const long cpu_before = cpu_ms(daemon.id());
      for (int i = 0; i < 20; ++i) EXPECT_EQ(busy.fetch("m"), mesh.packets);
      RecordProperty("cpu_ms_of_20_fetches", static_cast<int>(cpu_ms(daemon.id()) - cpu_before));
      const Latencies pings = bystander.stop();
      RecordProperty("ping_p50_us", static_cast<int>(pings.quantile(0.5) * 1000));
      RecordProperty("ping_p99_us", static_cast<int>(pings.quantile(0.99) * 1000));
      EXPECT_LT(pings.quantile(0.5), 100);
    } else if (!kSanitized) {
      EXPECT_LT(after, resident + idle) << "KiB; the memory of those who left was not used again";
    }
    const auto closing = Clock::now();
    sessions.clear();
    EXPECT_TRUE(sessions_become(daemon, 1)) << status_of(daemon);
    RecordProperty("close_ms" + suffix,
                   static_cast<int>(std::chrono::duration_cast<milliseconds>(Clock::now() - closing).count()));
    RecordProperty("left_kib" + suffix, static_cast<int>(resident_kib(daemon.id())));
  }
  EXPECT_EQ(busy.fetch("m"), mesh.packets);
  busy = {};
  EXPECT_TRUE(sessions_become(daemon, 0));
}

}  // namespace
}  // namespace pmcd::test
