// SPDX-License-Identifier: MIT
// The request queue with the FIFO rule: who goes next, who holds a slot, what a session that leaves takes with it.
#include "daemon/scheduler/scheduler.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "daemon/scheduler/registry.h"

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

TEST(Registry, KnowsFifoAndNothingElse) {
  ASSERT_EQ(all_rules().size(), 1U);
  EXPECT_EQ(all_rules()[0].name, "fifo");
  EXPECT_FALSE(all_rules()[0].summary.empty());
  ASSERT_NE(make_rule("fifo"), nullptr);
  EXPECT_EQ(make_rule("fifo")->name(), "fifo");
  EXPECT_EQ(make_rule("FIFO"), nullptr);
  EXPECT_EQ(make_rule(""), nullptr);
}

TEST(Fifo, OldestFirst) {
  Scheduler scheduler(make_rule("fifo"), 1);
  ASSERT_TRUE(scheduler.enqueue(request(1, 5, Time{30})));
  ASSERT_TRUE(scheduler.enqueue(request(2, 9, Time{10})));
  ASSERT_TRUE(scheduler.enqueue(request(3, 1, Time{20})));
  EXPECT_EQ(serve_all(scheduler), (std::vector<RequestKey>{2, 3, 1}));
}

TEST(Fifo, TiesBySessionThenKey) {
  Scheduler scheduler(make_rule("fifo"), 1);
  ASSERT_TRUE(scheduler.enqueue(request(4, 2, Time{10})));
  ASSERT_TRUE(scheduler.enqueue(request(3, 2, Time{10})));
  ASSERT_TRUE(scheduler.enqueue(request(9, 1, Time{10})));
  EXPECT_EQ(serve_all(scheduler), (std::vector<RequestKey>{9, 3, 4}));
}

TEST(Scheduler, TakenRequestCarriesItsValuesAndTimes) {
  Scheduler scheduler(make_rule("fifo"), 1);
  ASSERT_TRUE(scheduler.enqueue(request(1, 5, Time{30}, 4096)));
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
  Scheduler scheduler(make_rule("fifo"), 2);
  for (RequestKey key = 1; key <= 3; ++key) ASSERT_TRUE(scheduler.enqueue(request(key, key, Time{1})));
  EXPECT_TRUE(scheduler.take(Time{2}));
  EXPECT_TRUE(scheduler.take(Time{2}));
  EXPECT_FALSE(scheduler.take(Time{2}));
  EXPECT_EQ(scheduler.running(), 2U);
  EXPECT_EQ(scheduler.waiting(), 1U);
  EXPECT_TRUE(scheduler.fail(1, Time{3}));
  const auto third = scheduler.take(Time{4});
  ASSERT_TRUE(third);
  EXPECT_EQ(third->key, 3U);
}

TEST(Scheduler, KeyIsTakenOnce) {
  Scheduler scheduler(make_rule("fifo"), 1);
  EXPECT_TRUE(scheduler.enqueue(request(1, 1, Time{1})));
  EXPECT_FALSE(scheduler.enqueue(request(1, 2, Time{2})));
  ASSERT_TRUE(scheduler.take(Time{3}));
  EXPECT_FALSE(scheduler.enqueue(request(1, 2, Time{4})));
  EXPECT_EQ(scheduler.waiting(), 0U);
}

TEST(Scheduler, WithdrawTouchesOnlyWaitingRequests) {
  Scheduler scheduler(make_rule("fifo"), 1);
  ASSERT_TRUE(scheduler.enqueue(request(1, 1, Time{1})));
  ASSERT_TRUE(scheduler.enqueue(request(2, 1, Time{2})));
  ASSERT_TRUE(scheduler.take(Time{3}));
  EXPECT_FALSE(scheduler.withdraw(1));
  EXPECT_TRUE(scheduler.withdraw(2));
  EXPECT_FALSE(scheduler.withdraw(2));
  EXPECT_EQ(scheduler.waiting(), 0U);
  EXPECT_EQ(scheduler.running(), 1U);
}

TEST(Scheduler, OnlyRunningRequestsFinish) {
  Scheduler scheduler(make_rule("fifo"), 1);
  ASSERT_TRUE(scheduler.enqueue(request(1, 1, Time{1})));
  EXPECT_FALSE(scheduler.complete(1, Time{2}));
  EXPECT_FALSE(scheduler.requeue(1, 0, Time{2}));
  ASSERT_TRUE(scheduler.take(Time{3}));
  EXPECT_TRUE(scheduler.complete(1, Time{4}));
  EXPECT_FALSE(scheduler.complete(1, Time{5}));
  EXPECT_FALSE(scheduler.fail(1, Time{5}));
}

TEST(Scheduler, RequeuedGoesToTheEndWithWhatRemains) {
  Scheduler scheduler(make_rule("fifo"), 1);
  ASSERT_TRUE(scheduler.enqueue(request(1, 1, Time{1}, 100)));
  ASSERT_TRUE(scheduler.enqueue(request(2, 2, Time{2})));
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
  Scheduler scheduler(make_rule("fifo"), 2);
  ASSERT_TRUE(scheduler.enqueue(request(1, 1, Time{1})));
  ASSERT_TRUE(scheduler.enqueue(request(2, 2, Time{2})));
  ASSERT_TRUE(scheduler.enqueue(request(3, 1, Time{3})));
  ASSERT_TRUE(scheduler.enqueue(request(4, 2, Time{4})));
  ASSERT_EQ(scheduler.take(Time{5})->key, 1U);
  ASSERT_EQ(scheduler.take(Time{5})->key, 2U);
  EXPECT_EQ(scheduler.remove_session(1, Time{6}), (std::vector<RequestKey>{1, 3}));
  EXPECT_EQ(scheduler.running(), 1U);
  EXPECT_EQ(scheduler.waiting(), 1U);
  EXPECT_FALSE(scheduler.complete(1, Time{7}));
  ASSERT_EQ(scheduler.take(Time{7})->key, 4U);
  EXPECT_TRUE(scheduler.remove_session(1, Time{8}).empty());
}

/// Writes down what a rule is told.
class Recorder final : public Rule {
 public:
  explicit Recorder(std::vector<std::string>& log) : log_(log) {}
  [[nodiscard]] std::string_view name() const override { return "recorder"; }
  void enqueued(const Request& r) override {
    next_ = r.key;
    note("enqueued", r.key);
  }
  void removed(const Request& r) override {
    next_.reset();
    note("removed", r.key);
  }
  [[nodiscard]] std::optional<RequestKey> next() const override { return next_; }
  void started(const Request& r, Time) override { note("started", r.key); }
  void progressed(const Request& r, std::uint64_t bytes, Time) override {
    note("progressed " + std::to_string(bytes), r.key);
  }
  void finished(const Request& r, Outcome outcome, Time) override {
    note("finished " + std::to_string(static_cast<int>(outcome)), r.key);
  }
  void session_gone(SessionKey session, Time) override { note("gone", session); }

 private:
  void note(const std::string& what, std::uint64_t key) { log_.push_back(what + ' ' + std::to_string(key)); }
  std::vector<std::string>& log_;
  std::optional<RequestKey> next_;
};

TEST(Scheduler, TellsTheRuleEachEventOnceAndInOrder) {
  std::vector<std::string> log;
  Scheduler scheduler(std::make_unique<Recorder>(log), 1);
  scheduler.enqueue(request(1, 8, Time{1}));
  scheduler.take(Time{2});
  scheduler.progressed(1, 40, Time{3});
  scheduler.progressed(2, 40, Time{3});
  scheduler.requeue(1, 40, Time{4});
  scheduler.take(Time{5});
  scheduler.complete(1, Time{6});
  scheduler.enqueue(request(2, 8, Time{7}));
  scheduler.remove_session(8, Time{8});
  EXPECT_EQ(log, (std::vector<std::string>{"enqueued 1", "removed 1", "started 1", "progressed 40 1", "finished 2 1",
                                           "enqueued 1", "removed 1", "started 1", "finished 0 1", "enqueued 2",
                                           "removed 2", "gone 8"}));
}

}  // namespace
}  // namespace pmcd::scheduler
