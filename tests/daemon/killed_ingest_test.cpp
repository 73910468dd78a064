// SPDX-License-Identifier: MIT
// 200 ingests, in each of which the client or the daemon is killed (kill -9) at a random moment: whatever was confirmed
// is there and whole, whatever is there is whole, and the database opens every time. The moments come from a fixed
// seed.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <thread>

#include "daemon/store/mesh_store.h"
#include "tests/daemon/daemon_process.h"
#include "tests/daemon/killed_mesh.h"
#include "tests/daemon/raw_client.h"

namespace pmcd::test {
namespace {

using std::chrono::microseconds;
using std::chrono::steady_clock;

class KilledIngest : public ::testing::Test {
 protected:
  pid_t start_client(const DaemonProcess& daemon, unsigned number) {
    return start_program({INGEST_PROGRAM, daemon.admin_socket(), "m" + std::to_string(number), std::to_string(number)},
                         folder_.file("client.log"));
  }

  /// Every mesh in the database is whole; all of `confirmed` are there.
  void check(const std::set<unsigned>& confirmed) {
    const auto opened = store::MeshStore::open(folder_.file("meshes.db"));
    ASSERT_TRUE(opened.ok()) << opened.error().detail;
    store::MeshStore& store = *opened.value();
    const auto meshes = store.list();
    ASSERT_TRUE(meshes.ok()) << meshes.error().detail;
    std::set<unsigned> present;
    for (const store::MeshSummary& mesh : meshes.value().meshes) {
      const unsigned number = static_cast<unsigned>(std::stoul(mesh.name.substr(1)));
      present.insert(number);
      const FakeMesh expected = killed_mesh(number);
      const auto found = store.find(mesh.name);
      ASSERT_TRUE(found.ok()) << found.error().detail;
      ASSERT_EQ(found.value().levels.size(), expected.packets.size());
      for (std::size_t level = 0; level < expected.packets.size(); ++level) {
        const auto packet = store.read_packet(mesh.id, static_cast<std::uint32_t>(level));
        ASSERT_TRUE(packet.ok()) << mesh.name << " packet " << level << ": " << packet.error().detail;
        ASSERT_EQ(packet.value(), expected.packets[level]) << mesh.name << " packet " << level;
      }
    }
    for (const unsigned number : confirmed) EXPECT_TRUE(present.contains(number)) << "m" << number << " was confirmed";
    unconfirmed_ = present.size() - confirmed.size();
  }

  TemporaryFolder folder_;
  std::size_t unconfirmed_ = 0;  ///< meshes that are there although the client did not live to hear so
};

TEST_F(KilledIngest, LeavesWholeMeshesOrNone) {
  constexpr unsigned kIngests = 200;
  std::mt19937 random(20'261'122);
  std::set<unsigned> confirmed;
  auto daemon = std::make_unique<DaemonProcess>(folder_.path());
  // How long an ingest takes here, so that the kills fall before, within and behind it.
  microseconds whole{0};
  for (unsigned number = 1'000; number < 1'003; ++number) {
    const auto start = steady_clock::now();
    ASSERT_EQ(wait_for_end(start_client(*daemon, number)), 0);
    whole = std::max(whole, std::chrono::duration_cast<microseconds>(steady_clock::now() - start));
    confirmed.insert(number);
  }
  unsigned daemons_killed = 0;
  unsigned cut = 0;
  for (unsigned number = 0; number < kIngests; ++number) {
    const pid_t client = start_client(*daemon, number);
    std::this_thread::sleep_for(
        microseconds(std::uniform_int_distribution<std::int64_t>(0, whole.count() * 6 / 5)(random)));
    if (random() % 2 == 0) {
      ::kill(client, SIGKILL);
    } else {
      daemon->kill();
      ++daemons_killed;
    }
    const int code = wait_for_end(client);
    code == 0 ? static_cast<void>(confirmed.insert(number)) : static_cast<void>(++cut);
    if (daemon->id() == 0) {
      if (daemons_killed % 10 == 0) check(confirmed);
      daemon = std::make_unique<DaemonProcess>(folder_.path());
      ASSERT_NE(daemon->request_port(), 0) << "after kill " << daemons_killed;
    }
    if (HasFatalFailure()) return;
  }
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(), 0);
  check(confirmed);
  RecordProperty("cut", static_cast<int>(cut));
  std::cout << confirmed.size() << " confirmed, " << cut << " cut, of which " << unconfirmed_ << " were stored; "
            << daemons_killed << " daemons killed; an ingest takes up to " << whole.count() << " us\n";
  // The kills must have met all kinds of moments, or nothing was shown.
  EXPECT_GT(confirmed.size(), 10U);
  EXPECT_GT(cut, 40U);
  EXPECT_GT(daemons_killed, 60U);
}

}  // namespace
}  // namespace pmcd::test
