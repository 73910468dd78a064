// SPDX-License-Identifier: MIT
// Running transfers: from the slot that the scheduler gives to the acknowledgement of the last byte.
#include "daemon/net/dispatcher.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "daemon/net/on_exit.h"
#include "daemon/net/packet_cache.h"
#include "daemon/net/session.h"
#include "proto/messages.h"

namespace pmcd::net {
namespace {

constexpr std::size_t kMostAbandoned = 16;

}  // namespace

Dispatcher::Dispatcher(scheduler::Policy policy, MeshSource& meshes, TaskGroup& tasks, const Limits& limits)
    : scheduler_(std::move(policy)),
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
  if (transfer.of && transfer.of->profile) {
    request.profile = transfer.of->profile;
    request.rest_bytes = request.profile->bytes_behind(transfer.packet);
  }
  scheduler_.enqueue(request, scheduler_now());
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
  const std::size_t dropped = transfer.session->data().drop_tail(key);
  it->second.next -= dropped;
  turn_of(transfer).line.taken_back(dropped);
  if (it->second.stage == Stage::stopped) {
    scheduler_.withdraw(key);
    release(key);
    transfer.session->requests().transfer_cancelled(transfer);
  } else if (it->second.stage == Stage::reading) {
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
  watched_.erase(session);
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
  while (abandoned_.size() < kMostAbandoned) {
    const auto request = scheduler_.take(scheduler_now(), abandoned_.size());
    if (!request) break;
    auto node = waiting_.extract(request->key);
    Turn& turn = turn_of(node.mapped());
    const std::uint64_t acknowledged = turn.channel->acknowledged_position();
    // One that owes from an earlier turn has no new grace.
    const bool owes = turn.line.pace.has_begun() && acknowledged < turn.channel->queued_position();
    if (turn.running.empty() && !owes) turn.line.pace.begin(acknowledged, Clock::now());
    turn.running.push_back(request->key);
    watched_.insert(request->session);
    Running running;
    running.next = node.mapped().offset;
    running.transfer = std::move(node.mapped());
    running_.emplace(request->key, std::move(running));
    guarded(request->key, [&] { start(request->key); });
  }
  hurry();
  if (watching_ || watched_.empty()) return;
  watching_ = true;
  tasks_.spawn("transfer watch", watch());
}

Dispatcher::Turn& Dispatcher::turn_of(const Transfer& transfer) {
  const auto it = turns_.find(transfer.session->key());
  if (it != turns_.end()) return it->second;
  auto channel = transfer.session->data().shared_from_this();
  DataLine line(*channel, limits_);
  Turn turn{transfer.session, std::move(channel), std::move(line), {}};
  return turns_.emplace(transfer.session->key(), std::move(turn)).first->second;
}

void Dispatcher::start(Key key) {
  Running& running = running_.at(key);
  Transfer& transfer = running.transfer;
  if (transfer.list) {
    begin_reading(key, "mesh list",
                  meshes_.mesh_list(transfer.list->filter, transfer.list->after, transfer.list->most));
    return;
  }
  transfer.kept.reset();
  if (!transfer.bytes) transfer.bytes = meshes_.cached_packet(transfer.mesh, transfer.packet);
  if (transfer.bytes && transfer.bytes->size() == scheduler_.find(key)->size_bytes) {
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
  if (bytes && !it->second.transfer.list && bytes.value()->size() != scheduler_.find(key)->size_bytes) {
    bytes = store::Error{store::ErrorCode::database_corrupt, "a packet has not the length that its level says"};
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
  Turn& turn = turn_of(transfer);
  Channel& data = *turn.channel;
  const std::uint64_t total = transfer.bytes->size();
  const scheduler::Client* client = scheduler_.clients().find(transfer.session->key());
  const std::size_t chunk = turn.line.chunk_bytes(client == nullptr ? std::nullopt : client->speed);
  while (running.next < total && data.has_room() && data.unwritten() < chunk &&
         !is_held_back(transfer.session->key(), turn)) {
    if (running.begun && !may_go_on(key)) return;
    const std::size_t size = std::min<std::size_t>(chunk, total - running.next);
    const auto head = proto::encode_chunk_header({transfer.id, transfer.handle, transfer.packet, running.next, total},
                                                 static_cast<std::uint32_t>(size));
    const bool begins = !running.begun && turn.channel->acknowledged_position() == turn.channel->queued_position();
    data.send(proto::Bytes(head.begin(), head.end()), transfer.bytes, running.next, size, key);
    turn.line.queued(size);
    running.next += size;
    if (!running.begun) scheduler_.turn_begins(key, scheduler_now());
    running.begun = true;
    if (begins) look(transfer.session->key(), turn, Clock::now());
  }
  // What holds it back is acknowledged soon, or after the pause to which its looks have come.
  const Duration wait = turn.line.held_back ? std::max(turn.line.pause, kFirstPoll) : kLongestPoll;
  look_by(transfer.session->key(), turn, Clock::now() + wait);
  if (running.next == total) end_sending(key);
}

bool Dispatcher::is_held_back(scheduler::SessionKey session, Turn& turn) {
  const scheduler::Client* client = scheduler_.clients().find(session);
  const bool shares = !draining_ && scheduler_.frees_slot_when_written() && scheduler_.has_others(session);
  turn.line.held_back = shares && client != nullptr && !client->speed &&
                        turn.line.has_enough(scheduler_.clients().guessed_speed(session));
  return turn.line.held_back;
}

bool Dispatcher::may_go_on(Key key) {
  Running& running = running_.at(key);
  // A mesh list is one short page. When the daemon ends, what runs is to come to its end.
  if (running.transfer.list || draining_) return true;
  if (!scheduler_.quantum_is_over(key, scheduler_now())) return true;
  // What may fail for want of memory comes before the scheduler hears of it.
  auto room = room_for_packet(running.transfer);
  if (scheduler_.yield(key, running.next, scheduler_now(), abandoned_.size())) return true;
  ++interruptions_;
  if (!room) running.transfer.bytes.reset();
  running.transfer.kept = std::move(room);
  running.stage = Stage::stopped;
  const Turn& turn = turn_of(running.transfer);
  if (turn.channel->unwritten() > 0 || turn.line.held_back) {
    scheduler_.park(key);
  } else {
    wait_again(key);
  }
  pump_soon();
  return false;
}

std::shared_ptr<const void> Dispatcher::room_for_packet(const Transfer& transfer) {
  const std::size_t size = transfer.bytes->size();
  if (PacketCache::takes(size, limits_.cache_bytes) || size > limits_.cache_bytes - kept_bytes_) return nullptr;
  kept_bytes_ += size;
  // Not of null, which would look like no room.
  return std::shared_ptr<const void>(this, [this, size](const void*) { kept_bytes_ -= size; });
}

void Dispatcher::wait_again(Key key) {
  auto node = running_.extract(key);
  Transfer& transfer = node.mapped().transfer;
  transfer.offset = node.mapped().next;
  transfer.begun = transfer.begun || node.mapped().begun;
  std::erase(turn_of(transfer).running, key);
  scheduler_.unpark(key, scheduler_now());  // no effect when it was not parked
  waiting_.emplace(key, std::move(transfer));
}

void Dispatcher::end_sending(Key key) {
  Running& running = running_.at(key);
  running.stage = Stage::sent;
  const Transfer transfer = running.transfer;
  if (running.cancelled) {
    transfer.session->requests().transfer_cancelled(transfer);
  } else {
    transfer.session->requests().transfer_complete(transfer);
  }
  // The session may have closed over its last frame, and then nothing of it runs any more.
  const auto it = running_.find(key);
  if (it == running_.end()) return;
  Turn& turn = turn_of(transfer);
  it->second.transfer.bytes.reset();
  it->second.end_position = turn.channel->queued_position();
  // While nobody waits for the slot there is no hurry, and mostly the client's next request tells before.
  turn.line.pause = scheduler_.waiting() > 0 ? kFirstPoll : kLongestPoll;
  look_by(transfer.session->key(), turn, Clock::now() + turn.line.pause);
}

void Dispatcher::progress(scheduler::SessionKey session) {
  const auto turn = turns_.find(session);
  if (turn == turns_.end() || turn->second.running.empty()) return;
  // A copy: what follows may end any of them, or the session.
  const std::vector<Key> keys = turn->second.running;
  const bool takes = turn->second.channel->unwritten() == 0 && !is_held_back(session, turn->second);
  for (const Key key : keys) {
    const auto it = running_.find(key);
    if (!takes || it == running_.end() || it->second.stage != Stage::stopped) continue;
    wait_again(key);
    pump_soon();
  }
  for (const Key key : keys) {
    const auto it = running_.find(key);
    if (it != running_.end() && it->second.stage == Stage::sending) guarded(key, [&] { feed(key); });
  }
}

void Dispatcher::release(Key key) {
  const auto it = running_.find(key);
  if (const auto turn = turns_.find(it->second.transfer.session->key()); turn != turns_.end()) {
    std::erase(turn->second.running, key);
  }
  const std::uint64_t reached = it->second.next;
  running_.erase(it);
  scheduler_.fail(key, reached, scheduler_now());  // no effect when it was completed
  idle_.notify();
  if (draining_) watch_.notify();
  pump_soon();
}

void Dispatcher::switch_to(scheduler::Policy policy) {
  scheduler_.switch_to(std::move(policy), scheduler_now());
  pump_soon();
}

void Dispatcher::set_weight(scheduler::SessionKey session, double weight) {
  scheduler_.set_weight(session, weight, scheduler_now());
}

}  // namespace pmcd::net
