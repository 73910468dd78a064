// SPDX-License-Identifier: MIT
// Looking at the lines of those that are served: what their clients have acknowledged, which slots that frees, and who
// takes nothing. Each look is a system call, so they are as seldom as nobody waits.
#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>
#include <vector>

#include "daemon/net/dispatcher.h"
#include "daemon/net/on_exit.h"
#include "daemon/net/session.h"
#include "proto/messages.h"

namespace pmcd::net {
namespace {

using std::chrono::milliseconds;

/// Between two looks at how full the uplink is, while requests wait for it.
constexpr Duration kUplinkPoll = milliseconds(50);

}  // namespace

void Dispatcher::heard(scheduler::SessionKey session) {
  const auto turn = turns_.find(session);
  if (turn == turns_.end() || !watched_.contains(session)) return;
  look(session, turn->second, Clock::now());
  settle(session);
}

void Dispatcher::look(scheduler::SessionKey session, Turn& turn, Clock::time_point now) {
  const DataLine::News news = turn.line.look(now);
  scheduler_.observe(session, news.sample, scheduler_time(now));
  if (news.payload > 0) scheduler_.acknowledged(session, news.payload, scheduler_time(now));
}

bool Dispatcher::is_through(Key key, const Running& running, Turn& turn) const {
  if (running.stage != Stage::sent) return false;
  if (turn.channel->last_acknowledged() >= running.end_position) return true;
  // A turn that is over is so for one of which nothing is left to interrupt, too.
  if (!draining_ && scheduler_.quantum_is_over(key, scheduler_now())) return true;
  return scheduler_.frees_slot_when_written() && turn.line.sent();
}

void Dispatcher::settle(scheduler::SessionKey session) {
  const auto turn = turns_.find(session);
  if (turn == turns_.end()) return;
  for (const Key key : std::vector<Key>(turn->second.running)) {
    const Running& running = running_.at(key);
    // A client that takes nothing comes to no chunk boundary by itself, but its turn ends all the same.
    if (running.stage == Stage::sending && !may_go_on(key)) continue;
    if (!is_through(key, running, turn->second)) continue;
    if (!running.cancelled) scheduler_.complete(key, scheduler_now());
    release(key);
  }
  if (turn->second.running.empty() && !turn->second.line.owes()) watched_.erase(session);
  // What acknowledgements have made room for: no write of the channel tells of it.
  if (turn->second.line.held_back) progress(session);
}

void Dispatcher::look_by(scheduler::SessionKey session, Turn& turn, Clock::time_point when) {
  watched_.insert(session);
  const auto now = Clock::now();
  if (turn.line.look_at > now && turn.line.look_at <= when) return;
  turn.line.look_at = when;
  if (watching_ && when + kFirstPoll < watch_wakes_at_) watch_.notify();
}

awaitable<void> Dispatcher::watch() {
  const OnExit over([this] { watching_ = false; });
  const Duration tick = std::clamp<Duration>(limits_.stall / 8, milliseconds(5), milliseconds(250));
  Clock::time_point judge_at = Clock::now() + tick;
  // It outlasts a short pause between transfers, so that not each of them starts a watch of its own.
  for (bool idle = false; !watched_.empty() || !(idle || draining_);) {
    idle = watched_.empty();
    watch_wakes_at_ = std::min(judge_at, poll(Clock::now()));
    co_await watch_.wait_until(watch_wakes_at_);
    const auto now = Clock::now();
    if (now < judge_at) continue;
    judge_at = now + tick;
    judge(now);
  }
}

void Dispatcher::hurry() {
  if (scheduler_.waiting() == 0 || scheduler_.has_slot(scheduler_now(), abandoned_.size())) return;
  const auto soon = Clock::now() + kFirstPoll;
  for (auto& [key, running] : running_) {
    if (running.stage != Stage::sent || running.hurried) continue;
    running.hurried = true;
    Turn& turn = turn_of(running.transfer);
    turn.line.pause = kFirstPoll;
    look_by(running.transfer.session->key(), turn, soon);
  }
}

Clock::time_point Dispatcher::poll(Clock::time_point now) {
  std::vector<scheduler::SessionKey> due;
  for (const auto session : watched_) {
    if (turns_.at(session).line.look_at <= now) due.push_back(session);
  }
  for (const auto session : due) {
    const auto turn = turns_.find(session);
    if (turn == turns_.end()) continue;
    turn->second.line.pause = std::min(turn->second.line.pause * 2 + kFirstPoll, kLongestPoll);
    turn->second.line.look_at = now + turn->second.line.pause;
    look(session, turn->second, now);
    settle(session);
  }
  const bool uplink_matters = scheduler_.waiting() > 0 && scheduler_.frees_slot_when_written();
  if (uplink_matters && now >= uplink_at_) {
    uplink_at_ = now + kUplinkPoll;
    pump_soon();
  }
  Clock::time_point next = uplink_matters ? uplink_at_ : Clock::time_point::max();
  for (const auto session : watched_) next = std::min(next, turns_.at(session).line.look_at);
  return next;
}

void Dispatcher::judge(Clock::time_point now) {
  std::vector<std::pair<std::shared_ptr<Session>, Pace::Verdict>> dropped;
  for (const auto key : watched_) {
    Turn& turn = turns_.at(key);
    const auto session = turn.session.lock();
    if (!session || (turn.running.empty() && !turn.line.owes())) continue;
    const std::uint64_t acknowledged = turn.channel->acknowledged_position();
    const Pace::Verdict verdict = turn.line.pace.note(acknowledged, turn.line.owes(), now, limits_);
    if (verdict != Pace::Verdict::fine) dropped.emplace_back(session, verdict);
  }
  for (const auto& [session, verdict] : dropped) {
    session->close(proto::ErrorCode::stalled, verdict == Pace::Verdict::stalled
                                                  ? "the data channel acknowledges nothing"
                                                  : "the data channel acknowledges less than the least rate");
  }
}

void Dispatcher::drain() {
  draining_ = true;
  watch_.notify();
}

awaitable<bool> Dispatcher::wait_idle(Duration limit) {
  const Clock::time_point deadline = Clock::now() + limit;
  while (running() > 0 && Clock::now() < deadline) co_await idle_.wait_until(deadline);
  co_return running() == 0;
}

}  // namespace pmcd::net
