// SPDX-License-Identifier: MIT
// Running transfers: from the slot that the scheduler gives to the acknowledgement of the last byte.
#include "daemon/net/dispatcher.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "daemon/net/on_exit.h"
#include "daemon/net/session.h"
#include "proto/messages.h"

namespace pmcd::net {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kMostAbandoned = 16;
constexpr Duration kFirstPoll = milliseconds(1);
constexpr Duration kLongestPoll = milliseconds(20);

scheduler::Time scheduler_time(Clock::time_point time) {
  return std::chrono::duration_cast<scheduler::Time>(time.time_since_epoch());
}
scheduler::Time scheduler_now() {
  return scheduler_time(Clock::now());
}

}  // namespace

Dispatcher::Dispatcher(scheduler::Scheduler scheduler, MeshSource& meshes, TaskGroup& tasks, const Limits& limits)
    : scheduler_(std::move(scheduler)),
      meshes_(meshes),
      tasks_(tasks),
      limits_(limits),
      idle_(tasks.executor()),
      watch_(tasks.executor()) {}

Dispatcher::Key Dispatcher::enqueue(Transfer transfer, std::uint64_t size_bytes, Clock::time_point asked_at) {
  scheduler::Request request;
  request.key = next_key_++;
  request.session = transfer.session->key();
  request.mesh = static_cast<scheduler::MeshKey>(transfer.mesh);
  request.packet = transfer.packet;
  request.size_bytes = size_bytes;
  request.offset_bytes = transfer.offset;
  request.asked_at = scheduler_time(asked_at);
  scheduler_.enqueue(request);
  waiting_.emplace(request.key, std::move(transfer));
  pump_soon();
  return request.key;
}

void Dispatcher::cancel(Key key) {
  if (auto node = waiting_.extract(key); !node.empty()) {
    scheduler_.withdraw(key);
    node.mapped().session->requests().transfer_cancelled(node.mapped());
    return;
  }
  const auto it = running_.find(key);
  if (it == running_.end() || it->second.stage == Stage::sent) return;
  const Transfer transfer = it->second.transfer;
  it->second.cancelled = true;
  it->second.next -= transfer.session->data().drop_tail(key);
  if (it->second.stage == Stage::reading) {
    abandon(it->second, key);
    release(key);
    transfer.session->requests().transfer_cancelled(transfer);
  } else {
    end_sending(key);
  }
}

void Dispatcher::session_gone(scheduler::SessionKey session) {
  for (const Key key : scheduler_.remove_session(session, scheduler_now())) {
    waiting_.erase(key);
    if (const auto it = running_.find(key); it != running_.end()) {
      abandon(it->second, key);
      running_.erase(it);
    }
  }
  turns_.erase(session);
  idle_.notify();
  if (draining_) watch_.notify();
  pump_soon();
}

void Dispatcher::pump_soon() {
  if (pump_is_due_ || draining_) return;
  pump_is_due_ = true;
  asio::post(tasks_.executor(), [this] {
    pump_is_due_ = false;
    pump();
  });
}

void Dispatcher::pump() {
  if (draining_) return;
  // A read that nobody waits for any more keeps its slot from others: else a client that asks and cancels in turns
  // would fill the store's queue with work for nobody.
  while (abandoned_.size() < kMostAbandoned && scheduler_.running() + abandoned_.size() < scheduler_.slots()) {
    const auto request = scheduler_.take(scheduler_now());
    if (!request) break;
    auto node = waiting_.extract(request->key);
    Turn& turn = turns_[request->session];
    if (turn.running.empty()) {
      turn.pace.begin(node.mapped().session->data().last_acknowledged(), Clock::now());
    }
    turn.running.push_back(request->key);
    Running running;
    running.next = node.mapped().offset;
    running.transfer = std::move(node.mapped());
    running_.emplace(request->key, std::move(running));
    guarded(request->key, [&] { start(request->key); });
  }
  hurry();
  if (watching_ || running_.empty()) return;
  watching_ = true;
  tasks_.spawn("transfer watch", watch());
}

void Dispatcher::start(Key key) {
  Running& running = running_.at(key);
  Transfer& transfer = running.transfer;
  if (transfer.list) {
    begin_reading(key, "mesh list",
                  meshes_.mesh_list(transfer.list->filter, transfer.list->after, transfer.list->most));
    return;
  }
  transfer.bytes = meshes_.cached_packet(transfer.mesh, transfer.packet);
  if (transfer.bytes) {
    running.stage = Stage::sending;
    feed(key);
  } else {
    begin_reading(key, "packet read", meshes_.read_packet(transfer.mesh, transfer.packet));
  }
}

void Dispatcher::begin_reading(Key key, const char* name, awaitable<store::Result<SharedBytes>> answer) {
  tasks_.spawn(name, read(key, std::move(answer)));
  if (const auto it = running_.find(key); it != running_.end() && it->second.stage == Stage::starting) {
    it->second.stage = Stage::reading;
  }
}

void Dispatcher::abandon(const Running& running, Key key) {
  if (running.stage == Stage::reading) abandoned_.insert(key);
}

awaitable<void> Dispatcher::read(Key key, awaitable<store::Result<SharedBytes>> answer) {
  const OnExit over([this, key] {
    if (abandoned_.erase(key) > 0) pump_soon();
  });
  auto bytes = co_await std::move(answer);
  auto it = running_.find(key);
  if (it == running_.end()) co_return;  // cancelled, or the session is gone
  if (!bytes && bytes.error().code == store::ErrorCode::unknown_mesh && !it->second.transfer.list) {
    const auto session = it->second.transfer.session;
    const auto mesh = co_await session->requests().stored_anew(it->second.transfer.handle);
    it = running_.find(key);
    if (it == running_.end()) co_return;
    if (mesh) {
      it->second.transfer.mesh = *mesh;
      bytes = co_await meshes_.read_packet(*mesh, it->second.transfer.packet);
      it = running_.find(key);
      if (it == running_.end()) co_return;
    }
  }
  if (bytes) {
    it->second.transfer.bytes = std::move(bytes).value();
    it->second.stage = Stage::sending;
    guarded(key, [&] { feed(key); });
    co_return;
  }
  const Transfer transfer = it->second.transfer;
  release(key);
  transfer.session->requests().transfer_failed(transfer, bytes.error());
}

template <typename Step>
void Dispatcher::guarded(Key key, Step step) {
  try {
    step();
  } catch (const std::exception& error) {
    // Out of memory, most likely. The request cannot end as promised any more, so its session ends, and with it go its
    // slots.
    spdlog::error("transfer: {}", error.what());
    const auto it = running_.find(key);
    if (it == running_.end()) return;
    const auto session = it->second.transfer.session;
    session->close(proto::ErrorCode::internal_error, "the daemon cannot carry out this request");
  }
}

void Dispatcher::feed(Key key) {
  Running& running = running_.at(key);
  const Transfer& transfer = running.transfer;
  Channel& data = transfer.session->data();
  const std::uint64_t total = transfer.bytes->size();
  while (running.next < total && data.has_room()) {
    const std::size_t size = std::min<std::size_t>(limits_.chunk_bytes, total - running.next);
    const auto head = proto::encode_chunk_header({transfer.id, transfer.handle, transfer.packet, running.next, total},
                                                 static_cast<std::uint32_t>(size));
    data.send(proto::Bytes(head.begin(), head.end()), transfer.bytes, running.next, size, key);
    running.next += size;
  }
  if (running.next == total) end_sending(key);
}

void Dispatcher::end_sending(Key key) {
  Running& running = running_.at(key);
  running.stage = Stage::sent;
  // While nobody waits for the slot there is no hurry, and mostly the client's next request tells before.
  running.pause = scheduler_.waiting() > 0 ? kFirstPoll : kLongestPoll;
  running.poll_at = Clock::now() + running.pause;
  const Transfer transfer = running.transfer;
  if (running.cancelled) {
    transfer.session->requests().transfer_cancelled(transfer);
  } else {
    transfer.session->requests().transfer_complete(transfer);
  }
  // The session may have closed over its last frame, and then nothing of it runs any more.
  if (const auto it = running_.find(key); it != running_.end()) {
    it->second.transfer.bytes.reset();
    it->second.end_position = transfer.session->data().queued_position();
    if (watching_ && it->second.poll_at + kFirstPoll < watch_wakes_at_) watch_.notify();
  }
}

void Dispatcher::progress(scheduler::SessionKey session) {
  const auto turn = turns_.find(session);
  if (turn == turns_.end() || turn->second.running.empty()) return;
  // A copy: what follows may end any of them, or the session.
  for (const Key key : std::vector<Key>(turn->second.running)) {
    const auto it = running_.find(key);
    if (it != running_.end() && it->second.stage == Stage::sending) guarded(key, [&] { feed(key); });
  }
}

void Dispatcher::heard(scheduler::SessionKey session) {
  const auto turn = turns_.find(session);
  if (turn == turns_.end()) return;
  std::optional<std::uint64_t> acknowledged;
  for (const Key key : std::vector<Key>(turn->second.running)) {
    const Running& running = running_.at(key);
    if (running.stage != Stage::sent) continue;
    if (!acknowledged) acknowledged = running.transfer.session->data().acknowledged_position();
    if (*acknowledged >= running.end_position) settle(key, *acknowledged, Clock::now());
  }
}

void Dispatcher::settle(Key key, std::uint64_t acknowledged, Clock::time_point now) {
  Running& running = running_.at(key);
  if (acknowledged < running.end_position) {
    running.pause = std::min(running.pause * 2, kLongestPoll);
    running.poll_at = now + running.pause;
    return;
  }
  scheduler_.progressed(key, running.next - running.transfer.offset, scheduler_time(now));
  if (!running.cancelled) scheduler_.complete(key, scheduler_time(now));
  release(key);
}

void Dispatcher::release(Key key) {
  const auto it = running_.find(key);
  if (const auto turn = turns_.find(it->second.transfer.session->key()); turn != turns_.end()) {
    std::erase(turn->second.running, key);
  }
  running_.erase(it);
  scheduler_.fail(key, scheduler_now());  // no effect when it was completed
  idle_.notify();
  if (draining_) watch_.notify();
  pump_soon();
}

awaitable<void> Dispatcher::watch() {
  const OnExit over([this] { watching_ = false; });
  const Duration tick = std::clamp<Duration>(limits_.stall / 8, milliseconds(5), milliseconds(250));
  Clock::time_point judge_at = Clock::now() + tick;
  // It outlasts a short pause between transfers, so that not each of them starts a watch of its own.
  for (bool idle = false; !running_.empty() || !(idle || draining_);) {
    idle = running_.empty();
    watch_wakes_at_ = std::min(judge_at, poll(Clock::now()));
    co_await watch_.wait_until(watch_wakes_at_);
    const auto now = Clock::now();
    if (now < judge_at) continue;
    judge_at = now + tick;
    judge(now);
  }
}

void Dispatcher::hurry() {
  if (scheduler_.waiting() == 0 || scheduler_.running() < scheduler_.slots()) return;
  const auto soon = Clock::now() + kFirstPoll;
  for (auto& [key, running] : running_) {
    if (running.stage != Stage::sent || running.poll_at <= soon) continue;
    running.pause = kFirstPoll;
    running.poll_at = soon;
  }
  if (watching_ && watch_wakes_at_ > soon + kFirstPoll) watch_.notify();
}

Clock::time_point Dispatcher::poll(Clock::time_point now) {
  std::vector<Key> due;
  for (const auto& [key, running] : running_) {
    if (running.stage == Stage::sent && running.poll_at <= now) due.push_back(key);
  }
  for (const Key key : due) settle(key, running_.at(key).transfer.session->data().acknowledged_position(), now);
  Clock::time_point next = Clock::time_point::max();
  for (const auto& [key, running] : running_) {
    if (running.stage == Stage::sent) next = std::min(next, running.poll_at);
  }
  return next;
}

void Dispatcher::judge(Clock::time_point now) {
  std::vector<std::pair<std::shared_ptr<Session>, Pace::Verdict>> dropped;
  for (auto& [key, turn] : turns_) {
    if (turn.running.empty()) continue;
    const auto& session = running_.at(turn.running.front()).transfer.session;
    const std::uint64_t acknowledged = session->data().acknowledged_position();
    const bool owes = acknowledged < session->data().queued_position();
    const Pace::Verdict verdict = turn.pace.note(acknowledged, owes, now, limits_);
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
