// SPDX-License-Identifier: MIT
// What the daemon's dispatcher.cpp, data_line.cpp and channel.cpp do, in their order; what they ask the kernel is asked
// of the Connection.
#include "sim/packet_server.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pmcd::sim {
namespace {

constexpr std::uint64_t kChunkHead = 34;  ///< of proto/messages.h, its frame's header included
constexpr std::uint64_t kTransferEndFrame = 13;
constexpr std::uint64_t kChunkLeast = 512;
constexpr std::uint64_t kChunkMost = 64 * 1024;
constexpr std::uint64_t kChunkFirst = 4 * 1024;
constexpr std::uint64_t kQueuedBytes = 64 * 1024;
constexpr double kShortPause = 0.001;
constexpr double kLongPause = 0.020;
constexpr double kUplinkPause = 0.050;
constexpr double kBetweenInfos = 0.005;
constexpr double kAheadSeconds = 0.250;  ///< of a client that is not measured, where others want the uplink
constexpr double kJudgeEvery = 0.250;
constexpr double kStallSeconds = 10;

}  // namespace

PacketServer::PacketServer(const Scenario& scenario, const scheduler::Policy& policy, Timeline& timeline,
                           std::vector<std::unique_ptr<Connection>>& connections)
    : scenario_(scenario),
      timeline_(timeline),
      connections_(connections),
      scheduler_(policy),
      sessions_(scenario.clients.size()) {
  for (ClientId client = 0; client < sessions_.size(); ++client) {
    connections_[client]->on_writable = [this, client] { flush(client); };
  }
}

scheduler::Time PacketServer::time() const {
  return scheduler_time(timeline_.now());
}

void PacketServer::joined(ClientId client, std::uint64_t bytes) {
  queue(client, bytes);
}

void PacketServer::request(ClientId client, std::uint32_t mesh, std::uint32_t packet) {
  Session& session = sessions_[client];
  if (session.gone) return;
  session.line.push_back({mesh, packet, timeline_.now()});
  advance(client);
  // Who asks has mostly acknowledged what it had.
  if (!session.watched) return;
  look(client);
  settle(client);
}

void PacketServer::advance(ClientId client) {
  Session& session = sessions_[client];
  if (session.busy || session.line.empty()) return;
  session.busy = true;
  const Asked& asked = session.line.front();
  scheduler::Request request = request_for(asked, scenario_.meshes[asked.mesh], next_key_++, client);
  Transfer transfer;
  transfer.client = client;
  transfer.packet = asked.packet;
  transfer.total = request.size_bytes;
  waiting_.emplace(request.key, transfer);
  scheduler_.enqueue(std::move(request), time());
  pump_soon();
}

void PacketServer::leave(ClientId client) {
  Session& session = sessions_[client];
  if (std::exchange(session.gone, true)) return;
  for (const Key key : scheduler_.remove_session(session_of(client), time())) {
    waiting_.erase(key);
    running_.erase(key);
  }
  session.watched = false;
  watched_.erase(client);
  session.line.clear();
  session.running.clear();
  pump_soon();
}

void PacketServer::pump_soon() {
  if (std::exchange(pump_is_due_, true)) return;
  timeline_.soon([this] {
    pump_is_due_ = false;
    pump();
  });
}

void PacketServer::pump() {
  while (const auto request = scheduler_.take(time())) {
    auto node = waiting_.extract(request->key);
    Transfer& transfer = node.mapped();
    Session& session = sessions_[transfer.client];
    if (session.running.empty()) {
      session.progress_at = timeline_.now();
      session.judged = session.acknowledged;
    }
    session.running.push_back(request->key);
    session.watched = true;
    watched_.insert(transfer.client);
    transfer.stage = Stage::sending;
    transfer.begun = transfer.hurried = false;
    running_.insert(std::move(node));
    feed(request->key);
  }
  hurry();
  if (watching_ || watched_.empty()) return;
  watching_ = true;
  judge_at_ = timeline_.now() + kJudgeEvery;
  watch();
}

std::uint64_t PacketServer::chunk_bytes(ClientId client) {
  const scheduler::Client* known = scheduler_.clients().find(session_of(client));
  const auto speed = known == nullptr ? std::nullopt : known->speed;
  const auto tenth = static_cast<std::uint64_t>(speed.value_or(0) * scenario_.chunk_seconds);
  const std::uint64_t chunk = speed ? std::clamp(tenth, kChunkLeast, kChunkMost) : kChunkFirst;
  const std::uint64_t bound = std::max(chunk, tenth);
  std::uint64_t& told = sessions_[client].unsent_bound;
  if (told == 0 || std::max(bound, told) - std::min(bound, told) > told / 4) told = bound;
  return chunk;
}

void PacketServer::feed(Key key) {
  Transfer& transfer = running_.at(key);
  const ClientId client = transfer.client;
  Session& session = sessions_[client];
  const std::uint64_t chunk = chunk_bytes(client);
  while (transfer.next < transfer.total && session.queued - session.written < std::min(kQueuedBytes, chunk) &&
         !is_held_back(client)) {
    if (transfer.begun && !may_go_on(key)) return;
    const std::uint64_t size = std::min(chunk, transfer.total - transfer.next);
    const bool begins = !transfer.begun && acknowledged_position(client) == session.queued;
    queue(client, kChunkHead + size);
    session.chunks.push_back({session.queued, size});
    transfer.next += size;
    ++totals_.chunks;
    totals_.payload_bytes += size;
    if (!totals_.first_at) totals_.first_at = timeline_.now();
    if (!transfer.begun) scheduler_.turn_begins(key, time());
    transfer.begun = true;
    if (begins) look(client);
  }
  look_by(client, timeline_.now() + (session.held_back ? std::max(session.pause, kShortPause) : kLongPause));
  if (transfer.next == transfer.total) end_sending(key);
}

bool PacketServer::is_held_back(ClientId client) {
  Session& session = sessions_[client];
  const scheduler::Client* known = scheduler_.clients().find(session_of(client));
  const bool shares = scheduler_.frees_slot_when_written() && scheduler_.has_others(session_of(client));
  session.held_back = false;
  if (!shares || known == nullptr || known->speed) return false;
  const double guess = scheduler_.clients().guessed_speed(session_of(client)).value_or(0);
  const double enough = std::max(2.0 * kChunkFirst, guess * (session.round_trip + kAheadSeconds));
  session.held_back = static_cast<double>(session.queued - acknowledged_position(client)) >= enough;
  return session.held_back;
}

bool PacketServer::may_go_on(Key key) {
  Transfer& transfer = running_.at(key);
  if (!scheduler_.quantum_is_over(key, time())) return true;
  if (scheduler_.yield(key, transfer.next, time())) return true;
  transfer.stage = Stage::stopped;
  const Session& session = sessions_[transfer.client];
  if (session.written < session.queued || session.held_back) {
    scheduler_.park(key);
  } else {
    wait_again(key);
  }
  pump_soon();
  return false;
}

void PacketServer::wait_again(Key key) {
  auto node = running_.extract(key);
  std::erase(sessions_[node.mapped().client].running, key);
  waiting_.insert(std::move(node));
  scheduler_.unpark(key, time());
}

void PacketServer::end_sending(Key key) {
  Transfer& transfer = running_.at(key);
  const ClientId client = transfer.client;
  Session& session = sessions_[client];
  transfer.stage = Stage::sent;
  const std::uint64_t last_byte = session.queued;
  queue(client, kTransferEndFrame);
  transfer.end_position = session.queued;
  if (on_packet) on_packet(client, transfer.packet, last_byte, session.queued);
  session.line.pop_front();
  session.busy = false;
  advance(client);
  session.pause = scheduler_.waiting() > 0 ? kShortPause : kLongPause;
  look_by(client, timeline_.now() + session.pause);
}

void PacketServer::release(Key key) {
  std::erase(sessions_[running_.at(key).client].running, key);
  running_.erase(key);
  pump_soon();
}

void PacketServer::queue(ClientId client, std::uint64_t bytes) {
  Session& session = sessions_[client];
  session.queued += bytes;
  if (std::exchange(session.flush_is_due, true)) return;
  timeline_.soon([this, client] { flush(client); });
}

void PacketServer::flush(ClientId client) {
  Session& session = sessions_[client];
  session.flush_is_due = false;
  if (session.gone) return;
  const std::uint64_t bound =
      session.unsent_bound == 0 ? std::numeric_limits<std::uint32_t>::max() : session.unsent_bound;
  session.written += connections_[client]->write(session.queued - session.written, bound);
  if (session.written < session.queued) {
    session.flush_is_due = true;
    connections_[client]->call_when_writable(bound);
  }
  progress(client);
}

void PacketServer::progress(ClientId client) {
  Session& session = sessions_[client];
  const std::vector<Key> keys = session.running;
  const bool takes = session.written == session.queued && !is_held_back(client);
  for (const Key key : keys) {
    const auto it = running_.find(key);
    if (!takes || it == running_.end() || it->second.stage != Stage::stopped) continue;
    wait_again(key);
    pump_soon();
  }
  for (const Key key : keys) {
    const auto it = running_.find(key);
    if (it != running_.end() && it->second.stage == Stage::sending) feed(key);
  }
}

std::uint64_t PacketServer::acknowledged_position(ClientId client) {
  Session& session = sessions_[client];
  session.acknowledged = connections_[client]->acknowledged();
  return session.acknowledged;
}

void PacketServer::look(ClientId client) {
  Session& session = sessions_[client];
  const Connection& connection = *connections_[client];
  const double now = timeline_.now();
  scheduler::SpeedSample sample;
  sample.acknowledged = acknowledged_position(client);
  sample.owes = sample.acknowledged < session.queued;
  sample.now = scheduler_time(now);
  std::uint64_t payload = 0;
  while (!session.chunks.empty() && session.chunks.front().end <= sample.acknowledged) {
    payload += session.chunks.front().payload;
    session.chunks.pop_front();
  }
  if (session.info_at < 0 || now - session.info_at >= kBetweenInfos) {
    session.info_at = now;
    if (std::isfinite(connection.least_round_trip())) session.round_trip = connection.least_round_trip();
    sample.acknowledged = std::min(sample.acknowledged + connection.sacked(), session.queued);
    if (!connection.is_application_limited()) sample.delivery_rate = connection.delivery_rate();
    // The kernel says it in milliseconds.
    if (!sample.owes)
      sample.now = scheduler_time(now - std::floor((now - connection.last_acknowledgement()) * 1000) / 1000);
  }
  sample.round_trip = scheduler_time(session.round_trip);
  scheduler_.observe(session_of(client), sample, time());
  if (payload > 0) scheduler_.acknowledged(session_of(client), payload, time());
}

void PacketServer::settle(ClientId client) {
  Session& session = sessions_[client];
  for (const Key key : std::vector<Key>(session.running)) {
    const Transfer& transfer = running_.at(key);
    if (transfer.stage == Stage::sending && !may_go_on(key)) continue;
    if (transfer.stage != Stage::sent) continue;
    const bool has_left = scheduler_.frees_slot_when_written() && session.written == session.queued &&
                          connections_[client]->unsent() == 0;
    const bool is_through =
        session.acknowledged >= transfer.end_position || scheduler_.quantum_is_over(key, time()) || has_left;
    if (!is_through) continue;
    scheduler_.complete(key, time());
    release(key);
  }
  if (session.running.empty() && session.acknowledged >= session.queued) {
    session.watched = false;
    watched_.erase(client);
  }
  if (session.held_back) progress(client);
}

void PacketServer::look_by(ClientId client, double when) {
  Session& session = sessions_[client];
  session.watched = true;
  watched_.insert(client);
  const double now = timeline_.now();
  if (session.look_at > now && session.look_at <= when) return;
  session.look_at = when;
  if (watching_ && when + kShortPause < wakes_at_) watch_at(when);
}

void PacketServer::watch_at(double when) {
  wakes_at_ = when;
  timeline_.at(timeline_.waking(when), [this, number = ++watch_] {
    if (number == watch_) watch();
  });
}

void PacketServer::hurry() {
  if (scheduler_.waiting() == 0 || scheduler_.has_slot(time())) return;
  const double soon = timeline_.now() + kShortPause;
  for (auto& [key, transfer] : running_) {
    if (transfer.stage != Stage::sent || transfer.hurried) continue;
    transfer.hurried = true;
    sessions_[transfer.client].pause = kShortPause;
    look_by(transfer.client, soon);
  }
}

void PacketServer::watch() {
  const double now = timeline_.now();
  std::vector<ClientId> due;
  for (const ClientId client : watched_) {
    if (sessions_[client].look_at <= now) due.push_back(client);
  }
  for (const ClientId client : due) {
    Session& session = sessions_[client];
    session.pause = std::min(session.pause * 2 + kShortPause, kLongPause);
    session.look_at = now + session.pause;
    look(client);
    settle(client);
  }
  const bool uplink_matters = scheduler_.waiting() > 0 && scheduler_.frees_slot_when_written();
  if (uplink_matters && now >= uplink_at_) {
    uplink_at_ = now + kUplinkPause;
    pump_soon();
  }
  if (now >= judge_at_) {
    judge_at_ = now + kJudgeEvery;
    judge();
  }
  if (watched_.empty()) {
    watching_ = false;
    ++watch_;
    return;
  }
  double next = uplink_matters ? std::min(judge_at_, uplink_at_) : judge_at_;
  for (const ClientId client : watched_) next = std::min(next, sessions_[client].look_at);
  watch_at(next);
}

void PacketServer::judge() {
  std::vector<ClientId> stalled;
  for (const ClientId client : watched_) {
    Session& session = sessions_[client];
    const std::uint64_t acknowledged = acknowledged_position(client);
    const bool owes = acknowledged < session.queued;
    if (acknowledged > session.judged || !owes) session.progress_at = timeline_.now();
    session.judged = acknowledged;
    if (timeline_.now() - session.progress_at >= kStallSeconds) stalled.push_back(client);
  }
  for (const ClientId client : stalled) {
    leave(client);
    connections_[client]->reset();
    ++totals_.dropped;
    if (on_drop) on_drop(client);
  }
}

}  // namespace pmcd::sim
