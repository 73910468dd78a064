// SPDX-License-Identifier: MIT
// Running transfers: from the slot that the scheduler gives to the acknowledgement of the last byte.
#include "daemon/net/dispatcher.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>
#include <vector>

#include "daemon/net/session.h"
#include "proto/messages.h"

namespace pmcd::net {
namespace {

using std::chrono::milliseconds;

constexpr Duration kFirstPoll = milliseconds(1);
constexpr Duration kLongestPoll = milliseconds(20);

scheduler::Time scheduler_time(Clock::time_point time) {
  return std::chrono::duration_cast<scheduler::Time>(time.time_since_epoch());
}
scheduler::Time scheduler_now() {
  return scheduler_time(Clock::now());
}

}  // namespace

Dispatcher::Dispatcher(scheduler::Scheduler scheduler, Catalog& catalog, TaskGroup& tasks, const Limits& limits)
    : scheduler_(std::move(scheduler)),
      catalog_(catalog),
      tasks_(tasks),
      limits_(limits),
      idle_(tasks.executor()),
      watch_(tasks.executor()) {}

void Dispatcher::enqueue(Transfer transfer, std::uint64_t size_bytes, Clock::time_point asked_at) {
  scheduler::Request request;
  request.key = next_key_++;
  request.session = transfer.session->key();
  request.mesh = static_cast<scheduler::MeshKey>(transfer.mesh);
  request.packet = transfer.packet;
  request.size_bytes = size_bytes;
  request.asked_at = scheduler_time(asked_at);
  scheduler_.enqueue(request);
  waiting_.emplace(request.key, std::move(transfer));
  pump();
}

void Dispatcher::session_gone(std::uint64_t session_key) {
  for (const scheduler::RequestKey key : scheduler_.remove_session(session_key, scheduler_now())) {
    waiting_.erase(key);
    running_.erase(key);
  }
  slots_changed();
}

void Dispatcher::slots_changed() {
  idle_.notify();
  if (draining_) watch_.notify();
  pump();
}

void Dispatcher::pump() {
  if (draining_) return;
  while (const auto request = scheduler_.take(scheduler_now())) {
    auto node = waiting_.extract(request->key);
    running_.emplace(request->key, Running{node.mapped().session, 0, Clock::now()});
    tasks_.spawn("transfer", run(request->key, std::move(node.mapped())));
  }
  if (watching_ || running_.empty()) return;
  watching_ = true;
  tasks_.spawn("stall watch", watch());
}

awaitable<void> Dispatcher::run(scheduler::RequestKey key, Transfer transfer) {
  try {
    co_await carry_out(key, transfer);
  } catch (const std::exception& error) {
    // Out of memory, most likely. The request cannot end as promised any more, so its session ends; the slot is free
    // either way.
    spdlog::error("transfer: {}", error.what());
    transfer.session->close(proto::ErrorCode::internal_error, "the daemon cannot carry out this request");
  }
  scheduler_.fail(key, scheduler_now());  // no effect when it was completed, or its session removed
  running_.erase(key);
  slots_changed();
}

awaitable<void> Dispatcher::carry_out(scheduler::RequestKey key, const Transfer& transfer) {
  Session& session = *transfer.session;
  if (session.closed()) co_return;
  SharedBytes bytes = transfer.bytes;
  if (!bytes) {
    const auto read = co_await catalog_.read_packet(transfer.mesh, transfer.packet);
    if (session.closed()) co_return;
    if (!read) {
      session.transfer_failed(transfer, read.error());
      co_return;
    }
    bytes = read.value();
  }
  if (!co_await send(transfer, bytes)) co_return;
  session.transfer_sent(transfer);
  const std::uint64_t end = session.data().queued_position();
  for (Duration pause = kFirstPoll; !session.closed() && session.data().acknowledged_position() < end;
       pause = std::min(pause * 2, kLongestPoll)) {
    co_await sleep_for(tasks_.executor(), pause);
  }
  if (session.closed()) co_return;
  scheduler_.progressed(key, bytes->size(), scheduler_now());
  scheduler_.complete(key, scheduler_now());
}

awaitable<bool> Dispatcher::send(const Transfer& transfer, const SharedBytes& bytes) {
  Session& session = *transfer.session;
  for (std::size_t offset = 0; offset < bytes->size();) {
    if (!co_await session.data().room()) {
      session.close(proto::ErrorCode::stalled, "the data channel takes nothing");
      co_return false;
    }
    const std::size_t size = std::min(limits_.chunk_bytes, bytes->size() - offset);
    const auto head = proto::encode_chunk_header({transfer.id, transfer.handle, transfer.packet, offset, bytes->size()},
                                                 static_cast<std::uint32_t>(size));
    session.data().send(proto::Bytes(head.begin(), head.end()), bytes, offset, size);
    offset += size;
  }
  co_return !session.closed();
}

awaitable<void> Dispatcher::watch() {
  const Duration tick = std::clamp<Duration>(limits_.stall / 8, milliseconds(5), milliseconds(250));
  while (!running_.empty()) {
    // It outlasts short pauses between transfers, so that not each of them starts a watch of its own.
    const Clock::time_point next = Clock::now() + tick;
    while (Clock::now() < next && !(draining_ && running_.empty())) co_await watch_.wait_until(next);
    std::vector<std::shared_ptr<Session>> stalled;
    const Clock::time_point now = Clock::now();
    for (auto& [key, transfer] : running_) {
      Channel& data = transfer.session->data();
      const std::uint64_t acknowledged = data.acknowledged_position();
      const bool owes = acknowledged < data.queued_position();
      if (acknowledged != transfer.acknowledged || !owes) {
        transfer.acknowledged = acknowledged;
        transfer.progress_at = now;
      } else if (now - transfer.progress_at >= limits_.stall) {
        stalled.push_back(transfer.session);
      }
    }
    for (const auto& session : stalled) {
      session->close(proto::ErrorCode::stalled, "the data channel acknowledges nothing");
    }
  }
  watching_ = false;
}

awaitable<bool> Dispatcher::wait_idle(Duration limit) {
  const Clock::time_point deadline = Clock::now() + limit;
  while (running() > 0 && Clock::now() < deadline) co_await idle_.wait_until(deadline);
  co_return running() == 0;
}

}  // namespace pmcd::net
