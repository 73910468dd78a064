// SPDX-License-Identifier: MIT
// The request queue with the FIFO rule: who goes next, who holds a slot, what a session that leaves takes with it.
#include "daemon/scheduler/scheduler.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "daemon/scheduler/registry.h"
#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

Request request(RequestKey key, SessionKey session, Time asked_at, std::uint64_t size_bytes = 100) {
  Request r;
  r.asked_at = asked_at;
  r.key = key;
  r.session = session;
  r.mesh = 7;
  r.packet = 3;
  r.size_bytes = size_bytes;
  return r;
}

std::vector<RequestKey> serve_all(Scheduler& scheduler) {
  std::vector<RequestKey> order;
  while (const auto next = scheduler.take(Time{1000})) {
    order.push_back(next->key);
    EXPECT_TRUE(scheduler.complete(next->key, Time{1000}));
  }
  return order;
}

TEST(Registry, KnowsAllRulesByName) {
  std::vector<std::string> names;
  for (const RuleEntry& entry : all_rules()) {
    names.emplace_back(entry.name);
    EXPECT_FALSE(entry.summary.empty());
    const Clients clients;
    const Surroundings surroundings{clients, 0};
    EXPECT_EQ(make_rule(entry.name, {}, surroundings)->name(), entry.name);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"fifo", "lcfs", "spf", "fcsf", "srpt", "fsp", "gain", "fair"}));
  EXPECT_EQ(find_rule("FIFO"), nullptr);
  EXPECT_EQ(find_rule(""), nullptr);
}

TEST(Fifo, OldestFirst) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  ASSERT_TRUE(enqueue(scheduler, request(1, 5, Time{30})));
  ASSERT_TRUE(enqueue(scheduler, request(2, 9, Time{10})));
  ASSERT_TRUE(enqueue(scheduler, request(3, 1, Time{20})));
  EXPECT_EQ(serve_all(scheduler), (std::vector<RequestKey>{2, 3, 1}));
}

TEST(Fifo, TiesBySessionThenKey) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  ASSERT_TRUE(enqueue(scheduler, request(4, 2, Time{10})));
  ASSERT_TRUE(enqueue(scheduler, request(3, 2, Time{10})));
  ASSERT_TRUE(enqueue(scheduler, request(9, 1, Time{10})));
  EXPECT_EQ(serve_all(scheduler), (std::vector<RequestKey>{9, 3, 4}));
}

TEST(Scheduler, TakenRequestCarriesItsValuesAndTimes) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  ASSERT_TRUE(enqueue(scheduler, request(1, 5, Time{30}, 4096)));
  const auto taken = scheduler.take(Time{99});
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->key, 1U);
  EXPECT_EQ(taken->session, 5U);
  EXPECT_EQ(taken->mesh, 7U);
  EXPECT_EQ(taken->packet, 3U);
  EXPECT_EQ(taken->size_bytes, 4096U);
  EXPECT_EQ(taken->asked_at, Time{30});
  EXPECT_EQ(taken->queued_at, Time{30});
}

TEST(Scheduler, NoMoreThanItsSlots) {
  Scheduler scheduler(policy_of("fifo", {}, 2));
  for (RequestKey key = 1; key <= 3; ++key) ASSERT_TRUE(enqueue(scheduler, request(key, key, Time{1})));
  EXPECT_TRUE(scheduler.take(Time{2}));
  EXPECT_TRUE(scheduler.take(Time{2}));
  EXPECT_FALSE(scheduler.take(Time{2}));
  EXPECT_EQ(scheduler.running(), 2U);
  EXPECT_EQ(scheduler.waiting(), 1U);
  EXPECT_TRUE(scheduler.fail(1, 0, Time{3}));
  const auto third = scheduler.take(Time{4});
  ASSERT_TRUE(third);
  EXPECT_EQ(third->key, 3U);
}

TEST(Scheduler, KeyIsTakenOnce) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  EXPECT_TRUE(enqueue(scheduler, request(1, 1, Time{1})));
  EXPECT_FALSE(enqueue(scheduler, request(1, 2, Time{2})));
  ASSERT_TRUE(scheduler.take(Time{3}));
  EXPECT_FALSE(enqueue(scheduler, request(1, 2, Time{4})));
  EXPECT_EQ(scheduler.waiting(), 0U);
}

TEST(Scheduler, WithdrawTouchesOnlyWaitingRequests) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  ASSERT_TRUE(enqueue(scheduler, request(1, 1, Time{1})));
  ASSERT_TRUE(enqueue(scheduler, request(2, 1, Time{2})));
  ASSERT_TRUE(scheduler.take(Time{3}));
  EXPECT_FALSE(scheduler.withdraw(1));
  EXPECT_TRUE(scheduler.withdraw(2));
  EXPECT_FALSE(scheduler.withdraw(2));
  EXPECT_EQ(scheduler.waiting(), 0U);
  EXPECT_EQ(scheduler.running(), 1U);
}

TEST(Scheduler, OnlyRunningRequestsFinish) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  ASSERT_TRUE(enqueue(scheduler, request(1, 1, Time{1})));
  EXPECT_FALSE(scheduler.complete(1, Time{2}));
  EXPECT_FALSE(scheduler.requeue(1, 0, Time{2}));
  ASSERT_TRUE(scheduler.take(Time{3}));
  EXPECT_TRUE(scheduler.complete(1, Time{4}));
  EXPECT_FALSE(scheduler.complete(1, Time{5}));
  EXPECT_FALSE(scheduler.fail(1, 0, Time{5}));
}

TEST(Scheduler, RequeuedGoesToTheEndWithWhatRemains) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  ASSERT_TRUE(enqueue(scheduler, request(1, 1, Time{1}, 100)));
  ASSERT_TRUE(enqueue(scheduler, request(2, 2, Time{2})));
  ASSERT_EQ(scheduler.take(Time{3})->key, 1U);
  EXPECT_FALSE(scheduler.requeue(1, 100, Time{4})) << "nothing would remain";
  ASSERT_TRUE(scheduler.requeue(1, 60, Time{4}));
  EXPECT_EQ(scheduler.running(), 0U);
  ASSERT_EQ(scheduler.take(Time{5})->key, 2U);
  ASSERT_TRUE(scheduler.complete(2, Time{6}));
  const auto again = scheduler.take(Time{7});
  ASSERT_TRUE(again);
  EXPECT_EQ(again->key, 1U);
  EXPECT_EQ(again->offset_bytes, 60U);
  EXPECT_EQ(again->size_bytes, 100U);
  EXPECT_EQ(again->asked_at, Time{1});
  EXPECT_EQ(again->queued_at, Time{4});
}

TEST(Scheduler, SessionTakesItsRequestsAlongAndFreesItsSlots) {
  Scheduler scheduler(policy_of("fifo", {}, 2));
  ASSERT_TRUE(enqueue(scheduler, request(1, 1, Time{1})));
  ASSERT_TRUE(enqueue(scheduler, request(2, 2, Time{2})));
  ASSERT_TRUE(enqueue(scheduler, request(3, 1, Time{3})));
  ASSERT_TRUE(enqueue(scheduler, request(4, 2, Time{4})));
  ASSERT_EQ(scheduler.take(Time{5})->key, 1U);
  ASSERT_EQ(scheduler.take(Time{5})->key, 2U);
  EXPECT_EQ(scheduler.remove_session(1, Time{6}), (std::vector<RequestKey>{1, 3}));
  EXPECT_EQ(scheduler.running(), 1U);
  EXPECT_EQ(scheduler.waiting(), 1U);
  EXPECT_FALSE(scheduler.complete(1, Time{7}));
  ASSERT_EQ(scheduler.take(Time{7})->key, 4U);
  EXPECT_TRUE(scheduler.remove_session(1, Time{8}).empty());
}

}  // namespace
}  // namespace pmcd::scheduler
