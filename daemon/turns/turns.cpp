// SPDX-License-Identifier: MIT
// From the slot that the scheduler gives to the end of what was asked for.
#include "daemon/turns/turns.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <utility>

namespace pmcd::turns {

Turns::Turns(scheduler::Policy policy, Host& host, const Limits& limits)
    : scheduler_(std::move(policy)), host_(host), limits_(limits) {}

void Turns::enqueue(scheduler::Request request) {
  scheduler_.enqueue(std::move(request), host_.now());
  host_.pump_soon();
}

void Turns::cancel(Key key) {
  const auto it = running_.find(key);
  if (it == running_.end()) {
    if (!scheduler_.withdraw(key)) return;
    host_.end(key, true);
    host_.released(key);
    return;
  }
  Running& running = it->second;
  if (running.stage == Stage::sent) return;
  running.cancelled = true;
  const std::size_t dropped = host_.take_back(key);
  running.next -= dropped;
  served(running.session, key).line.taken_back(dropped);
  if (running.stage == Stage::sending) {
    end_sending(key);
    return;
  }
  if (running.stage == Stage::stopped) scheduler_.withdraw(key);
  host_.end(key, true);
  if (running_.contains(key)) release(key);
}

void Turns::ready(Key key, const Content& content) {
  const auto it = running_.find(key);
  if (it == running_.end() || it->second.stage != Stage::fetching) return;
  it->second.content = content;
  it->second.stage = Stage::sending;
  guarded(key, [&] { feed(key); });
}

void Turns::fail(Key key) {
  const auto it = running_.find(key);
  if (it != running_.end() && it->second.stage == Stage::fetching) release(key);
}

std::vector<Turns::Key> Turns::session_gone(SessionKey session) {
  std::vector<Key> keys = scheduler_.remove_session(session, host_.now());
  for (const Key key : keys) {
    running_.erase(key);
    unhurried_.erase(key);
  }
  if (const auto turn = served_.find(session); turn != served_.end()) {
    looks_.erase({turn->second.line.look_at, session});
    served_.erase(turn);
  }
  host_.pump_soon();
  return keys;
}

void Turns::pump() {
  while (!draining_) {
    const auto key = scheduler_.due(host_.now(), host_.other_slots());
    if (!key) break;
    guarded(*key, [&] { begin(scheduler_.begin(*key, host_.now())); });
  }
  hurry();
}

void Turns::begin(const scheduler::Request& request) {
  Served& turn = served(request.session, request.key);
  const std::uint64_t acknowledged = turn.line.stream().acknowledged_position();
  // One that owes from an earlier turn has no new grace.
  const bool owes = turn.line.pace.has_begun() && turn.line.owes();
  if (turn.running.empty() && !owes) turn.line.pace.begin(acknowledged, host_.now());
  turn.running.push_back(request.key);
  set_look(request.session, turn.line, turn.line.look_at);
  Running running;
  running.session = request.session;
  running.next = request.offset_bytes;
  running_.emplace(request.key, running);
  if (const auto content = host_.fetch(request.key)) ready(request.key, *content);
}

Turns::Served& Turns::served(SessionKey session, Key key) {
  const auto it = served_.find(session);
  if (it != served_.end()) return it->second;
  return served_.emplace(session, Served{Line(host_.stream_of(key), limits_), {}}).first->second;
}

template <typename Step>
void Turns::guarded(Key key, Step step) {
  try {
    step();
  } catch (const std::exception& error) {
    // The request cannot end as promised any more, so its session ends, and with it go its slots.
    host_.broken(key, error);
  }
}

void Turns::feed(Key key) {
  Running& running = running_.at(key);
  const SessionKey session = running.session;
  Line& line = served(session, key).line;
  const scheduler::Client* client = scheduler_.clients().find(session);
  const std::size_t chunk = line.chunk_bytes(client == nullptr ? std::nullopt : client->speed);
  while (running.next < running.content.bytes && line.stream().has_room() && line.stream().unwritten() < chunk &&
         !is_held_back(session, line)) {
    if (running.begun && !may_go_on(key)) return;
    const std::size_t size = std::min<std::uint64_t>(chunk, running.content.bytes - running.next);
    const bool begins = !running.begun && line.stream().acknowledged_position() == line.stream().queued_position();
    host_.send(key, running.next, size);
    line.queued(size);
    running.next += size;
    if (!running.begun) scheduler_.turn_begins(key, host_.now());
    running.begun = true;
    if (begins) look(session, line, host_.now());
  }
  // What holds it back is acknowledged soon, or after the pause to which its looks have come.
  look_by(session, line, host_.now() + (line.held_back ? std::max(line.pause, kFirstPause) : kLongestPause));
  if (running.next == running.content.bytes) end_sending(key);
}

bool Turns::is_held_back(SessionKey session, Line& line) {
  const scheduler::Client* client = scheduler_.clients().find(session);
  const bool shares = !draining_ && scheduler_.frees_slot_when_written() && scheduler_.has_others(session);
  line.held_back =
      shares && client != nullptr && !client->speed && line.has_enough(scheduler_.clients().guessed_speed(session));
  return line.held_back;
}

bool Turns::may_go_on(Key key) {
  Running& running = running_.at(key);
  // When the daemon ends, what runs is to come to its end.
  if (!running.content.may_be_interrupted || draining_) return true;
  if (!scheduler_.quantum_is_over(key, host_.now())) return true;
  if (scheduler_.yield(key, running.next, host_.now(), host_.other_slots())) return true;
  ++interruptions_;
  running.stage = Stage::stopped;
  host_.interrupted(key);
  Line& line = served(running.session, key).line;
  if (line.stream().unwritten() > 0 || line.held_back) {
    scheduler_.park(key);
  } else {
    wait_again(key);
  }
  host_.pump_soon();
  return false;
}

void Turns::wait_again(Key key) {
  const auto it = running_.find(key);
  std::erase(served(it->second.session, key).running, key);
  running_.erase(it);
  scheduler_.unpark(key, host_.now());  // no effect when it was not parked
}

void Turns::end_sending(Key key) {
  Running& running = running_.at(key);
  running.stage = Stage::sent;
  unhurried_.insert(key);
  const SessionKey session = running.session;
  host_.end(key, running.cancelled);
  const auto it = running_.find(key);
  if (it == running_.end()) return;  // the session ended over its last frame
  Line& line = served(session, key).line;
  it->second.end_position = line.stream().queued_position();
  // While nobody waits for the slot there is no hurry, and mostly the client's next request tells before.
  line.pause = scheduler_.waiting() > 0 ? kFirstPause : kLongestPause;
  look_by(session, line, host_.now() + line.pause);
}

void Turns::progress(SessionKey session) {
  const auto turn = served_.find(session);
  if (turn == served_.end() || turn->second.running.empty()) return;
  // A copy: what follows may end any of them, or the session.
  const std::vector<Key> keys = turn->second.running;
  Line& line = turn->second.line;
  const bool takes = line.stream().unwritten() == 0 && !is_held_back(session, line);
  for (const Key key : keys) {
    const auto it = running_.find(key);
    if (!takes || it == running_.end() || it->second.stage != Stage::stopped) continue;
    wait_again(key);
    host_.pump_soon();
  }
  for (const Key key : keys) {
    const auto it = running_.find(key);
    if (it != running_.end() && it->second.stage == Stage::sending) guarded(key, [&] { feed(key); });
  }
}

void Turns::release(Key key) {
  const auto it = running_.find(key);
  if (const auto turn = served_.find(it->second.session); turn != served_.end()) std::erase(turn->second.running, key);
  const std::uint64_t reached = it->second.next;
  running_.erase(it);
  unhurried_.erase(key);
  scheduler_.fail(key, reached, host_.now());  // no effect when it was completed
  host_.released(key);
  host_.pump_soon();
}

void Turns::switch_to(scheduler::Policy policy) {
  scheduler_.switch_to(std::move(policy), host_.now());
  host_.pump_soon();
}

void Turns::set_weight(SessionKey session, double weight) {
  scheduler_.set_weight(session, weight, host_.now());
}

std::vector<Turns::Progress> Turns::running() const {
  std::vector<Progress> all;
  all.reserve(running_.size());
  for (const auto& [key, one] : running_) all.push_back({key, one.stage == Stage::stopped, one.next});
  return all;
}

}  // namespace pmcd::turns
