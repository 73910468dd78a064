// SPDX-License-Identifier: MIT
// Random lives of the queue under every rule and any options, against a model kept in plain lists: arrivals, turns,
// interruptions, parking, disconnects, speeds, weights and switches in any order lose no request, serve none twice, and
// with aging let nobody be overtaken by who asked later.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <map>
#include <set>

#include "tests/scheduler/driver.h"

namespace pmcd::scheduler {
namespace {

enum class State : std::uint8_t { waiting, parked, running };

struct Kept {
  Request request;
  State state = State::waiting;
};

Policy any_policy() {
  Policy policy;
  policy.rule = *rc::gen::element<std::string>("fifo", "lcfs", "spf", "fcsf", "srpt", "fsp", "gain", "fair");
  if (policy.rule == "fcsf" && *rc::gen::arbitrary<bool>()) policy.rule_options["burst"] = "2";
  if (policy.rule == "srpt" && *rc::gen::arbitrary<bool>()) policy.rule_options["scope"] = "packet";
  if (*rc::gen::arbitrary<bool>()) policy.quantum = milliseconds(*rc::gen::inRange(1, 50));
  if (*rc::gen::arbitrary<bool>()) policy.aging = milliseconds(*rc::gen::inRange(1, 500));
  policy.slots = *rc::gen::inRange<std::size_t>(1, 5);
  if (*rc::gen::inRange(0, 3) == 0) policy.slots.reset();
  if (*rc::gen::arbitrary<bool>()) policy.uplink = *rc::gen::inRange(1, 500) * 1'000.0;
  return policy;
}

std::shared_ptr<const MeshProfile> any_profile(unsigned choice) {
  if (choice % 3 == 0) return nullptr;
  std::vector<MeshProfile::Level> levels;
  for (unsigned k = 0; k < 8; ++k) {
    levels.push_back({1 + (choice >> k) % 999, 1 + k * 10, choice % 3 == 1 ? -1 : 1.0 / (1 + (choice >> k) % 97)});
  }
  return std::make_shared<MeshProfile>(levels, 1e-4);
}

class Life {
 public:
  Life() : scheduler_(any_policy()) {}

  void step(unsigned action, unsigned choice) {
    now_ += Time{choice % 3 == 0 ? 0 : choice % 100'000'000};  // equal times are common, so that ties are met
    switch (action) {
      case 0:
      case 1:
      case 2:
      case 3:
        return ask(choice);
      case 4:
      case 5:
        return take();
      case 6:
        return end(choice);
      case 7:
        return go_back(choice);
      case 8:
        return turn_away(choice);
      case 9:
        return scheduler_.switch_to(any_policy(), now_);
      case 10:
        return leave(choice);
      case 11:
        return scheduler_.set_weight(choice % 5, 0.5 + choice % 7, now_);
      case 12:
        return scheduler_.acknowledged(choice % 5, choice % 3'000, now_);
      default:
        position_[choice % 5] += choice % 200'000;
        return scheduler_.observe(choice % 5, {now_, position_[choice % 5], choice % 4 != 0, 0, Time{0}}, now_);
    }
  }

  void check() const {
    const std::size_t running = count(State::running);
    RC_ASSERT(scheduler_.running() == running);
    RC_ASSERT(scheduler_.waiting() == kept_.size() - running);
    const auto ranking = scheduler_.ranking(1'000, now_);
    std::set<RequestKey> ranked;
    for (const Ranked& one : ranking) {
      ranked.insert(one.key);
      RC_ASSERT(kept_.at(one.key).state == State::waiting);
      RC_ASSERT(!is_held(kept_.at(one.key)));
      RC_ASSERT(!one.reason.empty());
      RC_ASSERT(one.reason.find('-') == std::string::npos || one.reason.find(" -") == std::string::npos);
    }
    RC_ASSERT(ranked.size() == ranking.size());
    RC_ASSERT(ranking.size() == eligible());
    if (const auto few = scheduler_.ranking(2, now_); !ranking.empty()) {
      RC_ASSERT(few.size() == std::min<std::size_t>(2, ranking.size()));
      RC_ASSERT(few.front().key == ranking.front().key);
    }
    for (const auto& [key, kept] : kept_) {
      const Request* request = scheduler_.find(key);
      RC_ASSERT(request != nullptr);
      RC_ASSERT(request->asked_at == kept.request.asked_at);
      RC_ASSERT(request->queued_at == kept.request.queued_at);
      RC_ASSERT(request->offset_bytes == kept.request.offset_bytes);
      RC_ASSERT(request->queued_at >= request->asked_at);
      RC_ASSERT(request->queued_at <= now_);
      RC_ASSERT(scheduler_.is_running(key) == (kept.state == State::running));
      RC_ASSERT(scheduler_.is_held(key) == is_held(kept));
    }
    check_aging(ranking);
  }

  void to_the_end() {
    for (auto& [key, kept] : kept_) {
      if (kept.state == State::parked) {
        scheduler_.unpark(key, now_);
        kept.state = State::waiting;
      }
    }
    while (!kept_.empty()) {
      while (scheduler_.has_slot(now_) && eligible() > 0) take();
      RC_ASSERT(count(State::running) > 0U);
      end(0);
    }
    RC_ASSERT(asked_ == served_ + gone_);
    RC_ASSERT(scheduler_.ranking(9, now_).empty());
    RC_ASSERT(!scheduler_.take(now_));
  }

 private:
  [[nodiscard]] std::size_t count(State state) const {
    return static_cast<std::size_t>(
        std::count_if(kept_.begin(), kept_.end(), [state](const auto& one) { return one.second.state == state; }));
  }
  /// With slots=auto a request waits for the running one of its own session.
  [[nodiscard]] bool is_held(const Kept& kept) const {
    if (scheduler_.policy().slots || kept.state != State::waiting) return false;
    return std::any_of(kept_.begin(), kept_.end(), [&](const auto& other) {
      return other.second.state == State::running && other.second.request.session == kept.request.session;
    });
  }
  [[nodiscard]] std::size_t eligible() const {
    return static_cast<std::size_t>(std::count_if(kept_.begin(), kept_.end(), [this](const auto& one) {
      return one.second.state == State::waiting && !is_held(one.second);
    }));
  }
  RequestKey pick(State state, unsigned choice) const {
    const std::size_t all = count(state);
    if (all == 0) return 0;
    std::size_t skip = choice % all;
    for (const auto& [key, kept] : kept_) {
      if (kept.state == state && skip-- == 0) return key;
    }
    return 0;
  }

  /// Those older than aging come first, among themselves as they were asked for.
  void check_aging(const std::vector<Ranked>& ranking) const {
    if (!scheduler_.policy().aging) return;
    const auto age = [&](const Ranked& one) { return now_ - kept_.at(one.key).request.asked_at; };
    for (std::size_t n = 1; n < ranking.size(); ++n) {
      if (age(ranking[n]) > *scheduler_.policy().aging) RC_ASSERT(age(ranking[n]) <= age(ranking[n - 1]));
    }
  }

  void ask(unsigned choice) {
    Request r;
    r.key = ++asked_;
    r.session = choice % 5;
    r.mesh = choice / 5 % 3;
    r.packet = choice / 15 % 8;
    r.size_bytes = 1 + choice % 5'000;
    r.rest_bytes = r.packet == 7 ? 0 : choice % 9'000;
    r.profile = any_profile(choice);
    r.asked_at = now_;
    RC_ASSERT(scheduler_.enqueue(r, now_));
    RC_ASSERT(!scheduler_.enqueue(r, now_));
    r.queued_at = now_;
    kept_[r.key] = {r};
  }

  void take() {
    const auto ranking = scheduler_.ranking(1, now_);
    const bool slot = scheduler_.has_slot(now_);
    if (scheduler_.policy().slots) RC_ASSERT(slot == (count(State::running) < *scheduler_.policy().slots));
    if (count(State::running) == 0) RC_ASSERT(slot);
    const auto taken = scheduler_.take(now_);
    RC_ASSERT(taken.has_value() == (slot && eligible() > 0));
    if (!taken) return;
    RC_ASSERT(taken->key == ranking.front().key);
    Kept& kept = kept_.at(taken->key);
    RC_ASSERT(kept.state == State::waiting);
    const bool was_held = is_held(kept);
    RC_ASSERT(!was_held);
    kept.state = State::running;
    if (const auto aging = scheduler_.policy().aging) {
      // No aged request that could have gone was asked for before this one.
      for (const auto& [key, other] : kept_) {
        if (other.state != State::waiting || is_held(other) || now_ - other.request.asked_at <= *aging) continue;
        RC_ASSERT(other.request.asked_at >= kept.request.asked_at);
      }
    }
  }

  void end(unsigned choice) {
    const RequestKey key = pick(State::running, choice);
    if (key == 0) return;
    const bool fails = choice % 4 == 3;
    RC_ASSERT((fails ? scheduler_.fail(key, choice % 9'000, now_) : scheduler_.complete(key, now_)));
    RC_ASSERT(!scheduler_.complete(key, now_));
    kept_.erase(key);
    ++served_;
  }

  void go_back(unsigned choice) {
    const RequestKey key = pick(State::running, choice);
    if (key == 0) return;
    Kept& kept = kept_.at(key);
    Request& r = kept.request;
    const std::uint64_t offset = r.offset_bytes + r.remaining_bytes() / 2;
    if (choice % 2 == 0) {
      RC_ASSERT(scheduler_.requeue(key, offset, now_));
      kept.state = State::waiting;
    } else {
      scheduler_.turn_begins(key, now_ - Time{choice % 1'000});
      const bool goes_on = scheduler_.yield(key, offset, now_);
      RC_ASSERT(goes_on == scheduler_.is_running(key));
      kept.state = goes_on ? State::running : State::waiting;
      if (goes_on) RC_ASSERT(!scheduler_.quantum_is_over(key, now_));
    }
    r.offset_bytes = offset;
    r.queued_at = now_;
  }

  void turn_away(unsigned choice) {
    if (choice % 3 == 0) {
      const RequestKey key = pick(State::parked, choice);
      scheduler_.unpark(key, now_);
      if (key != 0) kept_.at(key).state = State::waiting;
      return;
    }
    const RequestKey key = pick(choice % 3 == 1 || choice % 2 == 0 ? State::waiting : State::parked, choice);
    if (key == 0) return;
    if (choice % 3 == 1) {
      scheduler_.park(key);
      kept_.at(key).state = State::parked;
    } else {
      RC_ASSERT(scheduler_.withdraw(key));
      kept_.erase(key);
      ++gone_;
    }
  }

  void leave(unsigned choice) {
    const SessionKey session = choice % 5;
    std::vector<RequestKey> expected;
    for (const auto& [key, kept] : kept_) {
      if (kept.request.session == session) expected.push_back(key);
    }
    RC_ASSERT(scheduler_.remove_session(session, now_) == expected);
    for (const RequestKey key : expected) kept_.erase(key);
    gone_ += expected.size();
    position_[session] = 0;
  }

  Scheduler scheduler_;
  std::map<RequestKey, Kept> kept_;
  std::map<SessionKey, std::uint64_t> position_;
  Time now_{0};
  std::uint64_t asked_ = 0;
  std::uint64_t served_ = 0;
  std::uint64_t gone_ = 0;
};

TEST(SchedulerLives, NoRequestIsLostOrServedTwiceUnderAnyRule) {
  EXPECT_TRUE(rc::check("random lives under random policies", [] {
    Life life;
    const auto steps =
        *rc::gen::scale(3.0, rc::gen::container<std::vector<std::pair<unsigned, unsigned>>>(rc::gen::pair(
                                 rc::gen::inRange(0U, 15U), rc::gen::resize(100, rc::gen::arbitrary<unsigned>()))));
    for (const auto& [action, choice] : steps) {
      life.step(action, choice);
      life.check();
    }
    life.to_the_end();
  }));
}

}  // namespace
}  // namespace pmcd::scheduler
