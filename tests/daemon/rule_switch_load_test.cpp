// SPDX-License-Identifier: MIT
// The rule is changed while clients fetch: nothing is lost, nothing comes twice, and nobody waits for the change. A
// program of its own, since it judges times: no other test runs beside it.
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "daemon/scheduler/registry.h"
#include "proto/admin_rules.h"
#include "tests/daemon/latencies.h"
#include "tests/daemon/raw_client.h"
#include "tests/daemon/server_in_thread.h"
#include "tests/sanitized.h"

namespace pmcd::test {
namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

proto::AdminSetRule random_policy(std::uint32_t id, std::mt19937& random) {
  const auto one_of = [&random](const std::vector<std::string>& words) { return words[random() % words.size()]; };
  const auto rules = scheduler::all_rules();
  const scheduler::RuleEntry& rule = rules[random() % rules.size()];
  proto::AdminSetRule message;
  message.id = id;
  message.rule = rule.name;
  for (const scheduler::RuleOption& option : rule.options) {
    message.options.push_back({std::string(option.name), one_of({option.words.begin(), option.words.end()})});
  }
  message.options.push_back({"quantum", one_of({"0", "1", "3", "50"})});
  message.options.push_back({"aging", one_of({"0", "1"})});
  message.options.push_back({"slots", one_of({"1", "2", "7", "auto"})});
  message.options.push_back({"uplink", one_of({"0", "2000", "1000000"})});
  return message;
}

/// For bench/scheduler/switch, in microseconds.
void record(const std::string& name, const Latencies& times) {
  ::testing::Test::RecordProperty(name + "_median_us", static_cast<int>(times.quantile(0.5) * 1000));
  ::testing::Test::RecordProperty(name + "_p99_us", static_cast<int>(times.quantile(0.99) * 1000));
  ::testing::Test::RecordProperty(name + "_most_us", static_cast<int>(times.quantile(1) * 1000));
}

/// The core that the server's thread has had so far.
class CoreClock {
 public:
  explicit CoreClock(ServerInThread& server)
      : id_(server.ask([](net::Server&) {
          clockid_t id{};
          EXPECT_EQ(::pthread_getcpuclockid(::pthread_self(), &id), 0);
          return id;
        })) {}
  [[nodiscard]] double milliseconds() const {
    timespec now{};
    EXPECT_EQ(::clock_gettime(id_, &now), 0);
    return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) / 1e6;
  }

 private:
  clockid_t id_;
};

/// How often each client reads: 0, as fast as it can.
class RuleSwitchUnder : public ::testing::TestWithParam<std::chrono::milliseconds> {};

TEST_P(RuleSwitchUnder, AThousandTimesUnderFiftyClients) {
  constexpr std::size_t kClients = 50;
  const unsigned switches = rounds(1'000);
  ServerInThread server;
  const FakeMesh mesh = fake_mesh(1, {400, 900, 5'000, 20'000, 70'000, 300'000, 600'000});
  ASSERT_EQ(RawAdmin::open(server.admin_socket()).ingest("m", mesh), "ok");

  std::atomic<bool> over = false;
  std::atomic<std::size_t> fetched = 0;
  std::vector<std::thread> clients;
  for (std::size_t i = 0; i < kClients; ++i) {
    clients.emplace_back([&, i] {
      // Buffers of many sizes, so that some come to a standstill in the middle of a chunk. Who reads seldom has a large
      // one: else it takes seconds for its turn.
      auto session = RawSession::open(server.request_port(), i % 3 == 0 && GetParam().count() == 0 ? 4'096 : 0);
      session.data.read_every(GetParam());
      do {
        ASSERT_EQ(session.fetch("m"), mesh.packets) << "client " << i;
        ++fetched;
      } while (!over);
    });
  }

  auto admin = RawAdmin::open(server.admin_socket());
  const CoreClock core(server);
  std::mt19937 random(7);
  std::vector<double> asked_ms;  // by who asks, on the same cores as all the others
  std::vector<double>
      inside_ms;  // as the daemon measures it, from the command to the new policy in force, commit included
  std::vector<double> work_ms;  // of the server's thread from question to answer, whatever else it did then included
  std::uint64_t version = 0;
  for (unsigned i = 0; i < switches; ++i) {
    const auto message = random_policy(i + 1, random);
    const auto asked = Clock::now();
    const double worked = core.milliseconds();
    const std::string text = admin.answer(proto::encode(message));
    work_ms.push_back(core.milliseconds() - worked);
    asked_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - asked).count());
    const json answer = json::parse(text);
    ASSERT_EQ(answer["after"]["rule"], message.rule) << text;
    if (answer["changed"]) {
      ++version;
      inside_ms.push_back(answer["seconds"].get<double>() * 1000);
    }
    ASSERT_EQ(answer["after"]["version"], version);
  }
  // Whatever came last, nobody has to wait long for the rest.
  proto::AdminSetRule last;
  last.id = switches + 1;
  last.rule = "fair";
  last.options = {{"slots", "auto"}, {"quantum", "50"}};
  EXPECT_TRUE(json::parse(admin.answer(proto::encode(last)))["changed"]);
  over = true;
  for (std::thread& client : clients) client.join();

  EXPECT_GE(fetched, kClients);
  const auto interrupted = server.ask([](net::Server& one) { return one.interruptions(); });
  EXPECT_GT(interrupted, 0U) << "no transfer was interrupted";
  const Latencies seen(asked_ms);
  const Latencies inside(inside_ms);
  const Latencies work(work_ms);
  record("seen", seen);
  record("inside", inside);
  record("work", work);
  RecordProperty("fetched", static_cast<int>(fetched));
  RecordProperty("interrupted", static_cast<int>(interrupted));
  if (kSanitized) return;
  EXPECT_LT(work.quantile(0.95), 10);
  EXPECT_LT(seen.quantile(0.5), 10) << "with the commit to the disk";
  // Clients that read as fast as they can are 50 threads that want the daemon's cores; it waits for them, not they for
  // it.
  if (GetParam().count() > 0) {
    EXPECT_LT(inside.quantile(0.9), 10);
  }
}

INSTANTIATE_TEST_SUITE_P(Clients, RuleSwitchUnder,
                         ::testing::Values(std::chrono::milliseconds(0), std::chrono::milliseconds(20)));

}  // namespace
}  // namespace pmcd::test
