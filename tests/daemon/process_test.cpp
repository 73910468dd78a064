// SPDX-License-Identifier: MIT
// The daemon as a program: exit codes, signals, what a restart finds, what it tells systemd, and life without
// descriptors.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "daemon/store/db.h"
#include "tests/daemon/daemon_process.h"
#include "tests/daemon/process_state.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using std::chrono::milliseconds;

class ProcessTest : public ::testing::Test {
 protected:
  Ended run(std::vector<std::string> options) {
    options.insert(options.begin(), PMCD_PROGRAM);
    return run_program(options, folder_.path());
  }
  std::vector<std::string> options(const std::string& name) const {
    return {"--database",     folder_.file(name + ".db"),
            "--admin-socket", folder_.file(name + ".sock"),
            "--request-port", "0",
            "--data-port",    "0"};
  }
  TemporaryFolder folder_;
};

TEST_F(ProcessTest, ExitCodesOfQuestions) {
  const Ended version = run({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.output.substr(0, 5), "pmcd ");
  EXPECT_EQ(run({"--help"}).code, 0);
  const Ended unknown = run({"--colour", "blue"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_EQ(unknown.output, "pmcd: unrecognised option '--colour'; --help lists the options\n");
}

TEST_F(ProcessTest, CheckConfig) {
  const std::string path = folder_.file("pmcd.conf");
  std::ofstream(path) << "slots = 2\n";
  const Ended good = run({"--check-config", "--config", path});
  EXPECT_EQ(good.code, 0);
  EXPECT_EQ(good.output, "the configuration is good\n");
  std::ofstream(path) << "slots = 2\nrule = dice\n";
  const Ended bad = run({"--check-config", "--config", path});
  EXPECT_EQ(bad.code, 2);
  EXPECT_EQ(bad.output,
            "pmcd: " + path + ":2: rule: \"dice\" is none of: fifo, lcfs, spf, fcsf, srpt, fsp, gain, fair\n");
  EXPECT_EQ(::access("/var/lib/pmcd/meshes.db", F_OK), -1) << "checking opens no database";
}

TEST_F(ProcessTest, CannotStart) {
  auto no_folder = options("x");
  no_folder[1] = folder_.file("no/such/folder/meshes.db");
  const Ended database = run(no_folder);
  EXPECT_EQ(database.code, 1);
  EXPECT_NE(database.output.find(no_folder[1] + ": No such file or directory"), std::string::npos) << database.output;

  DaemonProcess daemon(folder_.path());
  auto taken = options("other");
  taken[5] = std::to_string(daemon.request_port());
  const Ended port = run(taken);
  EXPECT_EQ(port.code, 1);
  EXPECT_NE(port.output.find("cannot listen on 127.0.0.1 port " + taken[5] + ": Address already in use"),
            std::string::npos)
      << port.output;

  auto same_database = options("another");
  same_database[1] = daemon.database();
  const Ended database_taken = run(same_database);
  EXPECT_EQ(database_taken.code, 1);
  EXPECT_NE(database_taken.output.find("meshes.db: database_locked: another pmcd serves it and holds "),
            std::string::npos)
      << database_taken.output;
  const std::string link = folder_.file("link.db");
  ASSERT_EQ(::symlink(daemon.database().c_str(), link.c_str()), 0);
  same_database[1] = link;
  EXPECT_NE(run(same_database).output.find("meshes.db.lock"), std::string::npos);

  auto same_socket = options("third");
  same_socket[3] = daemon.admin_socket();
  const Ended socket = run(same_socket);
  EXPECT_EQ(socket.code, 1);
  EXPECT_NE(socket.output.find("is a pmcd running already?"), std::string::npos) << socket.output;
  EXPECT_NE(RawAdmin::open(daemon.admin_socket()).connection.fd(), -1) << "the first one still answers";

  { store::Db(folder_.file("newer.db")).execute("PRAGMA application_id = 1347240772; PRAGMA user_version = 9"); }
  const Ended newer = run(options("newer"));
  EXPECT_EQ(newer.code, 1);
  EXPECT_NE(newer.output.find("database_newer: the database has schema version 9"), std::string::npos) << newer.output;
}

TEST_F(ProcessTest, KilledAndStartedAgainFindsItsMeshesAndItsSocket) {
  const FakeMesh mesh = fake_mesh(1, {100, 50'000});
  {
    DaemonProcess daemon(folder_.path());
    ASSERT_EQ(RawAdmin::open(daemon.admin_socket()).ingest("m", mesh), "ok");
    daemon.kill();
    ASSERT_EQ(::access(daemon.admin_socket().c_str(), F_OK), 0) << "a stale socket file is left";
  }
  DaemonProcess daemon(folder_.path());
  EXPECT_NE(daemon.log().find("stale socket file is replaced"), std::string::npos);
  auto session = RawSession::open(daemon.request_port());
  EXPECT_EQ(session.fetch("m"), mesh.packets);
}

TEST_F(ProcessTest, SigtermAndSigintDrainAndEndInOrder) {
  const FakeMesh mesh = fake_mesh(2, {3'000'000});
  for (const int number : {SIGTERM, SIGINT}) {
    DaemonProcess daemon(folder_.path());
    ASSERT_NE(RawAdmin::open(daemon.admin_socket()).ingest("m", mesh, true), "lost");
    auto running = RawSession::open(daemon.request_port(), 4096);
    running.open_mesh(1, "m");
    ASSERT_TRUE(running.data.stirs(kPatience));
    auto idle = RawSession::open(daemon.request_port());
    daemon.signal(number);
    // A newcomer is told while the transfer goes on.
    std::this_thread::sleep_for(milliseconds(100));
    auto late = RawConnection::tcp(daemon.request_port());
    late.send(proto::encode(proto::Hello{{}, "late"}));
    EXPECT_EQ(expect_error(late, 0), "shutting_down");
    EXPECT_EQ(running.next_transfer().bytes, mesh.packets[0]);
    expect_notice(idle.requests, proto::NoticeKind::draining);
    EXPECT_EQ(expect_error(idle.requests, 0), "shutting_down");
    EXPECT_EQ(daemon.wait(), 0);
    EXPECT_EQ(::access(daemon.admin_socket().c_str(), F_OK), -1);
    EXPECT_EQ(::access((daemon.database() + "-wal").c_str(), F_OK), -1) << "the database was closed";
  }
}

TEST_F(ProcessTest, SecondSignalEndsAtOnce) {
  DaemonProcess daemon(folder_.path());
  ASSERT_EQ(RawAdmin::open(daemon.admin_socket()).ingest("m", fake_mesh(3, {8'000'000})), "ok");
  auto stalled = RawSession::open(daemon.request_port(), 4096);
  stalled.open_mesh(1, "m");
  ASSERT_TRUE(stalled.data.stirs(kPatience));
  const auto start = std::chrono::steady_clock::now();
  daemon.signal(SIGTERM);
  std::this_thread::sleep_for(milliseconds(100));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - start, milliseconds(3'000));
}

TEST_F(ProcessTest, AdminCommandsAreLoggedWithTheCaller) {
  DaemonProcess daemon(folder_.path());
  auto admin = RawAdmin::open(daemon.admin_socket());
  const FakeMesh mesh = fake_mesh(4, {10});
  ASSERT_EQ(admin.ingest("m", mesh), "ok");
  admin.answer(proto::encode(proto::AdminList{1}));
  admin.answer(proto::encode(proto::AdminShow{2, "m"}));
  admin.answer(proto::encode(proto::AdminRemove{3, "m"}));
  const std::string who = "admin uid " + std::to_string(::getuid()) + " pid " + std::to_string(::getpid()) + ": ";
  const std::string log = daemon.log();
  const std::string bytes = std::to_string(mesh.packets[0].size()) + " bytes";
  for (const std::string& line : {"ingest \"m\": stored: 1 packets, " + bytes, std::string("list: done"),
                                  std::string("show \"m\": done"), std::string("remove \"m\": done")}) {
    EXPECT_NE(log.find(who + line), std::string::npos) << line << " is not in\n" << log;
  }
}

TEST_F(ProcessTest, TellsSystemd) {
  const std::string path = folder_.file("notify");
  const int notify = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(notify, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const timeval patience{10, 0};
  ::setsockopt(notify, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  const auto message = [notify] {
    std::array<char, 1024> text{};
    const ssize_t size = ::recv(notify, text.data(), text.size(), 0);
    return std::string(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  };
  DaemonProcess daemon(folder_.path(), {}, [&path] {
    ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
    ::setenv("JOURNAL_STREAM", "8:1", 1);
  });
  EXPECT_EQ(
      message(), "READY=1\nSTATUS=serving on 127.0.0.1, request port " + std::to_string(daemon.request_port()) +
                     ", data port " + [&] {
                       const std::string log = daemon.log();
                       const std::size_t at = log.find("data port ") + 10;
                       return log.substr(at, log.find(',', at) - at);
                     }());
  EXPECT_EQ(daemon.log().substr(0, 3), "<6>") << "priorities for the journal instead of times";
  daemon.signal(SIGTERM);
  EXPECT_EQ(message(),
            "STOPPING=1\nSTATUS=draining: running transfers may end, nothing new begins\nEXTEND_TIMEOUT_USEC=16000000");
  EXPECT_EQ(daemon.wait(), 0);
  ::close(notify);
}

/// User and system time of a process in clock ticks.
long cpu_ticks(pid_t process) {
  const std::string text = read_file("/proc/" + std::to_string(process) + "/stat");
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  long user = 0;
  long system = 0;
  fields >> user >> system;
  return user + system;
}

TEST_F(ProcessTest, TooFewDescriptorsToBeginWith) {
  std::vector<std::string> command = options("few");
  command.insert(command.begin(), {"/bin/sh", "-c", "ulimit -n 37; exec \"$@\"", "sh", PMCD_PROGRAM});
  const Ended ended = run_program(command, folder_.path());
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.output.find("37 descriptors (RLIMIT_NOFILE) are too few: at least 38 are needed"), std::string::npos)
      << ended.output;
}

TEST_F(ProcessTest, WithoutDescriptorsAcceptDoesNotSpinAndRecovers) {
  if (kSanitized) GTEST_SKIP() << "UBSan's look at an object needs a descriptor, and takes the lack of one for a fault";
  DaemonProcess daemon(folder_.path());
  // At its start it would refuse so few, and later it counts on them: so somebody has to take them away.
  const rlimit few{30, 30};
  ASSERT_EQ(::prlimit(daemon.id(), RLIMIT_NOFILE, &few, nullptr), 0);
  std::vector<RawConnection> flood;
  for (int i = 0; i < 60; ++i) {
    flood.push_back(RawConnection::tcp(daemon.request_port()));
    flood.back().send(proto::encode(proto::Hello{{}, "flood"}));
  }
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (daemon.log().find("Too many open files") == std::string::npos && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(milliseconds(10));
  }
  EXPECT_NE(daemon.log().find("Too many open files; trying again every 100 ms"), std::string::npos) << daemon.log();
  const long before = cpu_ticks(daemon.id());
  std::this_thread::sleep_for(milliseconds(1'000));
  EXPECT_LT(cpu_ticks(daemon.id()) - before, ::sysconf(_SC_CLK_TCK) / 5) << "a fifth of a second is far too much";
  flood.clear();
  std::this_thread::sleep_for(milliseconds(300));
  auto session = RawSession::open(daemon.request_port());
  session.requests.send(proto::encode(proto::GetMeshList{1}));
  EXPECT_EQ(session.next_transfer().result, proto::TransferResult::complete);
}

}  // namespace
}  // namespace pmcd::test
