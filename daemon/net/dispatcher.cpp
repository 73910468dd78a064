// SPDX-License-Identifier: MIT
#include "daemon/net/dispatcher.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "daemon/net/data_stream.h"
#include "daemon/net/on_exit.h"
#include "daemon/net/packet_cache.h"
#include "daemon/net/session.h"
#include "proto/messages.h"

namespace pmcd::net {
namespace {

constexpr std::size_t kMostAbandoned = 16;

turns::Time turns_time(Clock::time_point time) {
  return std::chrono::duration_cast<turns::Time>(time.time_since_epoch());
}

}  // namespace

Dispatcher::Dispatcher(scheduler::Policy policy, MeshSource& meshes, TaskGroup& tasks, const Limits& limits)
    : meshes_(meshes),
      tasks_(tasks),
      limits_(limits),
      turns_(std::move(policy), *this, limits),
      idle_(tasks.executor()),
      poll_(tasks.executor()) {}

Dispatcher::Key Dispatcher::enqueue(Transfer transfer, std::uint64_t size_bytes, Clock::time_point asked_at) {
  scheduler::Request request;
  request.key = next_key_++;
  request.session = transfer.session->key();
  request.mesh = static_cast<scheduler::MeshKey>(transfer.mesh);
  request.packet = transfer.packet;
  request.size_bytes = size_bytes;
  request.offset_bytes = transfer.offset;
  request.asked_at = turns_time(asked_at);
  if (transfer.of && transfer.of->profile) {
    request.profile = transfer.of->profile;
    request.rest_bytes = request.profile->bytes_behind(transfer.packet);
  }
  const Key key = request.key;
  transfers_.emplace(key, std::move(transfer));
  turns_.enqueue(std::move(request));
  return key;
}

void Dispatcher::session_gone(scheduler::SessionKey session) {
  for (const Key key : turns_.session_gone(session)) forget(key);
  served_.erase(session);
  idle_.notify();
  if (draining_) poll_.notify();
}

void Dispatcher::drain() {
  draining_ = true;
  turns_.drain();
  poll_.notify();
}

awaitable<bool> Dispatcher::wait_idle(Duration limit) {
  const Clock::time_point deadline = Clock::now() + limit;
  while (running() > 0 && Clock::now() < deadline) co_await idle_.wait_until(deadline);
  co_return running() == 0;
}

turns::Time Dispatcher::now() const {
  return turns_time(Clock::now());
}

std::size_t Dispatcher::other_slots() {
  // A read that nobody waits for any more keeps its slot from others: else a client that asks and cancels in turns
  // would fill the store's queue with work for nobody. So do a few of them from all.
  return abandoned_.size() < kMostAbandoned ? abandoned_.size() : scheduler::kMaxSlots;
}

void Dispatcher::pump_soon() {
  if (pump_is_due_ || draining_) return;
  asio::post(tasks_.executor(), [this] {
    pump_is_due_ = false;
    turns_.pump();
    if (polls_ || !turns_.has_to_poll()) return;
    tasks_.spawn("turns", poll_turns());
    polls_ = true;
  });
  pump_is_due_ = true;
}

void Dispatcher::poll_by(turns::Time /*when*/) {
  poll_.notify();
}

awaitable<void> Dispatcher::poll_turns() {
  const OnExit over([this] { polls_ = false; });
  // It outlasts a short pause between transfers, so that not each of them starts a task of its own.
  for (bool idle = false; turns_.has_to_poll() || !(idle || draining_);) {
    idle = !turns_.has_to_poll();
    co_await poll_.wait_until(Clock::time_point(std::chrono::duration_cast<Duration>(turns_.poll())));
  }
}

std::shared_ptr<turns::Stream> Dispatcher::stream_of(Key key) {
  const auto& session = transfers_.at(key).session;
  served_[session->key()] = session;
  return std::make_shared<DataStream>(session->data().shared_from_this());
}

std::optional<turns::Content> Dispatcher::fetch(Key key) {
  Transfer& transfer = transfers_.at(key);
  if (transfer.list) {
    begin_reading(key, "mesh list",
                  meshes_.mesh_list(transfer.list->filter, transfer.list->after, transfer.list->most));
    return std::nullopt;
  }
  transfer.kept.reset();
  if (!transfer.bytes) transfer.bytes = meshes_.cached_packet(transfer.mesh, transfer.packet);
  if (transfer.bytes && transfer.bytes->size() == scheduler().find(key)->size_bytes) {
    return turns::Content{transfer.bytes->size()};
  }
  begin_reading(key, "packet read", meshes_.read_packet(transfer.mesh, transfer.packet));
  return std::nullopt;
}

void Dispatcher::begin_reading(Key key, const char* name, awaitable<store::Result<SharedBytes>> answer) {
  Transfer& transfer = transfers_.at(key);
  transfer.bytes.reset();
  transfer.is_reading = true;
  try {
    tasks_.spawn(name, read(key, std::move(answer)));
  } catch (...) {
    transfer.is_reading = false;
    throw;
  }
}

awaitable<void> Dispatcher::read(Key key, awaitable<store::Result<SharedBytes>> answer) {
  try {
    co_await serve_from_store(key, std::move(answer));
  } catch (const std::exception& error) {
    if (const auto it = transfers_.find(key); it != transfers_.end()) it->second.is_reading = false;
    broken(key, error);
  }
  if (abandoned_.erase(key) > 0) pump_soon();
}

awaitable<void> Dispatcher::serve_from_store(Key key, awaitable<store::Result<SharedBytes>> answer) {
  auto bytes = co_await std::move(answer);
  auto it = transfers_.find(key);
  if (it == transfers_.end()) co_return;  // cancelled, or the session is gone
  if (!bytes && bytes.error().code == store::ErrorCode::unknown_mesh && !it->second.list) {
    const auto session = it->second.session;
    const auto mesh = co_await session->requests().stored_anew(it->second.handle);
    it = transfers_.find(key);
    if (it == transfers_.end()) co_return;
    if (mesh) {
      it->second.mesh = *mesh;
      bytes = co_await meshes_.read_packet(*mesh, it->second.packet);
      it = transfers_.find(key);
      if (it == transfers_.end()) co_return;
    }
  }
  Transfer& transfer = it->second;
  transfer.is_reading = false;
  if (bytes && !transfer.list && bytes.value()->size() != scheduler().find(key)->size_bytes) {
    bytes = store::Error{store::ErrorCode::database_corrupt, "a packet has not the length that its level says"};
  }
  if (bytes) {
    transfer.bytes = std::move(bytes).value();
    // A mesh list is one short page.
    turns_.ready(key, {transfer.bytes->size(), !transfer.list});
    co_return;
  }
  const Transfer failed = transfer;
  turns_.fail(key);
  failed.session->requests().transfer_failed(failed, bytes.error());
}

void Dispatcher::send(Key key, std::uint64_t offset, std::size_t size) {
  Transfer& transfer = transfers_.at(key);
  const auto head =
      proto::encode_chunk_header({transfer.id, transfer.handle, transfer.packet, offset, transfer.bytes->size()},
                                 static_cast<std::uint32_t>(size));
  transfer.session->data().send(proto::Bytes(head.begin(), head.end()), transfer.bytes, offset, size, key);
  transfer.begun = true;
}

std::size_t Dispatcher::take_back(Key key) {
  return transfers_.at(key).session->data().drop_tail(key);
}

void Dispatcher::end(Key key, bool is_cancelled) {
  Transfer& transfer = transfers_.at(key);
  transfer.bytes.reset();
  // A copy: the session may close over its last frame, and its transfers go with it.
  const Transfer ended = transfer;
  if (is_cancelled) {
    ended.session->requests().transfer_cancelled(ended);
  } else {
    ended.session->requests().transfer_complete(ended);
  }
}

void Dispatcher::interrupted(Key key) {
  Transfer& transfer = transfers_.at(key);
  transfer.kept = room_for_packet(transfer);
  if (!transfer.kept) transfer.bytes.reset();
}

std::shared_ptr<const void> Dispatcher::room_for_packet(const Transfer& transfer) {
  const std::size_t size = transfer.bytes->size();
  if (PacketCache::takes(size, limits_.cache_bytes) || size > limits_.cache_bytes - kept_bytes_) return nullptr;
  kept_bytes_ += size;
  // Not of null, which would look like no room.
  return std::shared_ptr<const void>(this, [this, size](const void*) { kept_bytes_ -= size; });
}

void Dispatcher::released(Key key) {
  forget(key);
  idle_.notify();
  if (draining_) poll_.notify();
}

void Dispatcher::forget(Key key) {
  const auto it = transfers_.find(key);
  if (it == transfers_.end()) return;
  if (it->second.is_reading) abandoned_.insert(key);
  transfers_.erase(it);
}

void Dispatcher::broken(Key key, const std::exception& error) {
  spdlog::error("transfer: {}", error.what());
  const auto it = transfers_.find(key);
  if (it == transfers_.end()) return;
  const auto session = it->second.session;
  session->close(proto::ErrorCode::internal_error, "the daemon cannot carry out this request");
}

void Dispatcher::drop(scheduler::SessionKey key, turns::Pace::Verdict verdict) {
  const auto it = served_.find(key);
  const auto session = it == served_.end() ? nullptr : it->second.lock();
  if (!session) return;
  session->close(proto::ErrorCode::stalled, verdict == turns::Pace::Verdict::stalled
                                                ? "the data channel acknowledges nothing"
                                                : "the data channel acknowledges less than the least rate");
}

}  // namespace pmcd::net
