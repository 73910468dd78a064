// SPDX-License-Identifier: MIT
// Random lives of a queue against a model kept in plain lists: no request lost, none served twice, never more running
// than slots, and FIFO's choice is always the least of those that wait.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <vector>

#include "daemon/scheduler/scheduler.h"
#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

/// What the scheduler must hold, kept the slow way.
struct Model {
  std::map<RequestKey, Request> waiting;
  std::map<RequestKey, Request> running;
  std::map<RequestKey, int> served;

  [[nodiscard]] const Request& first_in() const {
    return std::min_element(
               waiting.begin(), waiting.end(),
               [](const auto& a, const auto& b) { return QueueOrder::of(a.second) < QueueOrder::of(b.second); })
        ->second;
  }
};

RequestKey pick(const std::map<RequestKey, Request>& from, unsigned where) {
  auto it = from.begin();
  std::advance(it, static_cast<long>(where % from.size()));
  return it->first;
}

void drop_session(std::map<RequestKey, Request>& from, SessionKey session) {
  std::erase_if(from, [&](const auto& entry) { return entry.second.session == session; });
}

TEST(SchedulerProperty, NoneLostNoneTwiceSlotsNeverExceeded) {
  const bool holds = rc::check("random life of the queue", [] {
    const auto slots = static_cast<std::size_t>(*rc::gen::inRange(1, 5));
    Scheduler scheduler(policy_of("fifo", {}, slots));
    Model model;
    std::map<RequestKey, SessionKey> all;
    std::size_t gone = 0;
    RequestKey next_key = 1;
    Time now{0};
    const auto steps = *rc::gen::container<std::vector<std::pair<unsigned, unsigned>>>(
        rc::gen::pair(rc::gen::inRange(0U, 12U), rc::gen::arbitrary<unsigned>()));
    for (const auto& [action, choice] : steps) {
      now += Time{choice % 2};  // equal times are common, so that ties are met
      if (action <= 4) {
        Request r;
        r.key = next_key++;
        r.session = choice % 7;
        r.size_bytes = 1 + choice % 1000;
        r.asked_at = now;
        RC_ASSERT(enqueue(scheduler, r));
        r.queued_at = now;
        model.waiting[r.key] = r;
        all[r.key] = r.session;
      } else if (action <= 7) {
        const auto taken = scheduler.take(now);
        const bool possible = !model.waiting.empty() && model.running.size() < slots;
        RC_ASSERT(taken.has_value() == possible);
        if (taken) {
          RC_ASSERT(taken->key == model.first_in().key);
          model.running[taken->key] = model.waiting.at(taken->key);
          model.waiting.erase(taken->key);
        }
      } else if (action == 8 && !model.running.empty()) {
        const RequestKey key = pick(model.running, choice);
        RC_ASSERT(scheduler.complete(key, now));
        RC_ASSERT(++model.served[key] == 1);
        model.running.erase(key);
      } else if (action == 9 && !model.running.empty()) {
        const RequestKey key = pick(model.running, choice);
        Request r = model.running.at(key);
        const std::uint64_t offset = r.offset_bytes + (r.size_bytes - r.offset_bytes) / 2;
        RC_ASSERT(scheduler.requeue(key, offset, now) == (offset < r.size_bytes));
        r.offset_bytes = offset;
        r.queued_at = now;
        model.running.erase(key);
        model.waiting[key] = r;
      } else if (action == 10 && !model.waiting.empty()) {
        const RequestKey key = pick(model.waiting, choice);
        RC_ASSERT(scheduler.withdraw(key));
        model.waiting.erase(key);
        ++gone;
      } else if (action == 11) {
        const SessionKey session = choice % 7;
        const std::size_t before = model.waiting.size() + model.running.size();
        drop_session(model.waiting, session);
        drop_session(model.running, session);
        const std::size_t left = before - model.waiting.size() - model.running.size();
        scheduler.remove_session(session, now);
        gone += left;
      }
      RC_ASSERT(scheduler.running() <= slots);
      RC_ASSERT(scheduler.running() == model.running.size());
      RC_ASSERT(scheduler.waiting() == model.waiting.size());
      RC_ASSERT(all.size() == gone + model.served.size() + model.waiting.size() + model.running.size());
    }
    // Whatever is left is served to the last request.
    while (!model.running.empty() || !model.waiting.empty()) {
      while (const auto taken = scheduler.take(now)) {
        RC_ASSERT(taken->key == model.first_in().key);
        model.running[taken->key] = model.waiting.at(taken->key);
        model.waiting.erase(taken->key);
      }
      RC_ASSERT(!model.running.empty());
      const RequestKey key = model.running.begin()->first;
      RC_ASSERT(scheduler.complete(key, now));
      RC_ASSERT(++model.served[key] == 1);
      model.running.erase(key);
    }
    RC_ASSERT(all.size() == gone + model.served.size());
    RC_ASSERT(scheduler.waiting() + scheduler.running() == 0U);
  });
  EXPECT_TRUE(holds);
}

/// A hundred thousand waiting requests are served in an order of magnitude under what a linear scan would take.
TEST(SchedulerProperty, ChoiceDoesNotGrowWithTheQueue) {
  Scheduler scheduler(policy_of("fifo", {}, 1));
  constexpr RequestKey kRequests = 100'000;
  const auto start = std::chrono::steady_clock::now();
  for (RequestKey key = 1; key <= kRequests; ++key) {
    Request r;
    r.key = key;
    r.session = key / 8;
    r.size_bytes = 1;
    r.asked_at = Time{static_cast<std::int64_t>(key * 7919 % kRequests)};
    ASSERT_TRUE(enqueue(scheduler, r));
  }
  Time last{-1};
  for (RequestKey n = 0; n < kRequests; ++n) {
    const auto taken = scheduler.take(Time{1});
    ASSERT_TRUE(taken);
    ASSERT_GE(taken->queued_at, last);
    last = taken->queued_at;
    ASSERT_TRUE(scheduler.complete(taken->key, Time{1}));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}

}  // namespace
}  // namespace pmcd::scheduler
