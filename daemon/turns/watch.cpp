// SPDX-License-Identifier: MIT
// Looking at the streams of those that are served: what their clients have acknowledged, which slots that frees, and
// who takes nothing. Each look is a system call, so they are as seldom as nobody waits.
#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "daemon/turns/turns.h"

namespace pmcd::turns {
namespace {

using std::chrono::milliseconds;

/// Between two looks at how full the uplink is, while requests wait for it.
constexpr Time kUplinkPause = milliseconds(50);
constexpr Time kJudgeSeldom = milliseconds(250);
constexpr Time kJudgeOften = milliseconds(5);

}  // namespace

void Turns::heard(SessionKey session) {
  const auto turn = served_.find(session);
  if (turn == served_.end() || !is_watched(session, turn->second.line)) return;
  look(session, turn->second.line, host_.now());
  settle(session);
}

void Turns::look(SessionKey session, Line& line, Time now) {
  const Line::News news = line.look(now);
  scheduler_.observe(session, news.sample, now);
  if (news.payload > 0) scheduler_.acknowledged(session, news.payload, now);
}

bool Turns::is_through(Key key, const Running& running, Line& line) {
  if (running.stage != Stage::sent) return false;
  if (line.stream().last_acknowledged() >= running.end_position) return true;
  // A turn that is over is so for one of which nothing is left to interrupt, too.
  if (!draining_ && scheduler_.quantum_is_over(key, host_.now())) return true;
  return scheduler_.frees_slot_when_written() && line.sent();
}

void Turns::settle(SessionKey session) {
  const auto turn = served_.find(session);
  if (turn == served_.end()) return;
  Line& line = turn->second.line;
  for (const Key key : std::vector<Key>(turn->second.running)) {
    const Running& running = running_.at(key);
    // A client that takes nothing comes to no chunk boundary by itself, but its turn ends all the same.
    if (running.stage == Stage::sending && !may_go_on(key)) continue;
    if (!is_through(key, running, line)) continue;
    if (!running.cancelled) scheduler_.complete(key, host_.now());
    release(key);
  }
  if (turn->second.running.empty() && !line.owes()) looks_.erase({line.look_at, session});
  // What acknowledgements have made room for: no write of the stream tells of it.
  if (line.held_back) progress(session);
}

void Turns::look_by(SessionKey session, Line& line, Time when) {
  const bool stands = line.look_at > host_.now() && line.look_at <= when;
  set_look(session, line, stands ? line.look_at : when);
  if (stands) return;
  if (when + kFirstPause >= polls_at_) return;
  polls_at_ = when;
  host_.poll_by(when);
}

void Turns::set_look(SessionKey session, Line& line, Time when) {
  auto node = looks_.extract({line.look_at, session});
  if (node.empty()) {
    looks_.emplace(when, session);
  } else {
    node.value() = {when, session};
    looks_.insert(std::move(node));
  }
  line.look_at = when;
}

void Turns::hurry() {
  if (draining_ || scheduler_.waiting() == 0 || scheduler_.has_slot(host_.now(), host_.other_slots())) return;
  const Time soon = host_.now() + kFirstPause;
  for (const Key key : unhurried_) {
    const SessionKey session = running_.at(key).session;
    Line& line = served(session, key).line;
    line.pause = kFirstPause;
    look_by(session, line, soon);
  }
  unhurried_.clear();
}

Time Turns::poll() {
  const Time now = host_.now();
  const Time tick = std::clamp<Time>(Time(limits_.stall) / 8, kJudgeOften, kJudgeSeldom);
  if (!std::exchange(judges_, true)) judge_at_ = now + tick;
  std::vector<SessionKey> due;
  for (const auto& [when, session] : looks_) {
    if (when > now) break;
    due.push_back(session);
  }
  std::sort(due.begin(), due.end());  // the order of the sessions is the same wherever a simulation runs
  for (const SessionKey session : due) {
    const auto turn = served_.find(session);
    if (turn == served_.end()) continue;
    Line& line = turn->second.line;
    line.pause = std::min(line.pause * 2 + kFirstPause, kLongestPause);
    set_look(session, line, now + line.pause);
    look(session, line, now);
    settle(session);
  }
  const bool uplink_matters = scheduler_.waiting() > 0 && scheduler_.frees_slot_when_written();
  if (uplink_matters && now >= uplink_at_) {
    uplink_at_ = now + kUplinkPause;
    host_.pump_soon();
  }
  if (now >= judge_at_) {
    judge_at_ = now + tick;
    judge(now);
  }
  judges_ = has_to_poll();
  polls_at_ = uplink_matters ? std::min(judge_at_, uplink_at_) : judge_at_;
  if (!looks_.empty()) polls_at_ = std::min(polls_at_, looks_.begin()->first);
  return polls_at_;
}

void Turns::judge(Time now) {
  std::vector<std::pair<SessionKey, Pace::Verdict>> dropped;
  for (const auto& [when, session] : looks_) {
    Served& turn = served_.at(session);
    if (turn.running.empty() && !turn.line.owes()) continue;
    const std::uint64_t acknowledged = turn.line.stream().acknowledged_position();
    const Pace::Verdict verdict = turn.line.pace.note(acknowledged, turn.line.owes(), now, limits_);
    if (verdict != Pace::Verdict::fine) dropped.emplace_back(session, verdict);
  }
  for (const auto& [session, verdict] : dropped) host_.drop(session, verdict);
}

}  // namespace pmcd::turns
