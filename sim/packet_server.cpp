// SPDX-License-Identifier: MIT
#include "sim/packet_server.h"

#include <utility>

namespace pmcd::sim {
namespace {

constexpr std::uint64_t kChunkHead = 34;  ///< of proto/messages.h, its frame's header included
constexpr std::uint64_t kTransferEndFrame = 13;

turns::Limits limits_for(const Scenario& scenario) {
  turns::Limits limits;
  limits.chunk_seconds = scenario.chunk_seconds;
  return limits;
}

std::uint32_t client_of(scheduler::SessionKey session) {
  return static_cast<std::uint32_t>(session - session_of(0));
}

}  // namespace

PacketServer::PacketServer(const Scenario& scenario, const scheduler::Policy& policy, Timeline& timeline,
                           std::vector<std::unique_ptr<Connection>>& connections)
    : scenario_(scenario),
      timeline_(timeline),
      connections_(connections),
      limits_(limits_for(scenario)),
      turns_(policy, *this, limits_),
      sessions_(scenario.clients.size()) {
  for (ClientId client = 0; client < sessions_.size(); ++client) {
    sessions_[client].stream = std::make_shared<ServerStream>(timeline_, *connections_[client]);
    sessions_[client].stream->on_progress = [this, client] { turns_.progress(session_of(client)); };
  }
}

void PacketServer::joined(ClientId client, std::uint64_t bytes) {
  sessions_[client].stream->queue(bytes);
}

void PacketServer::request(ClientId client, std::uint32_t mesh, std::uint32_t packet) {
  Session& session = sessions_[client];
  if (session.gone) return;
  session.line.push_back({mesh, packet, timeline_.now()});
  advance(client);
  turns_.heard(session_of(client));
}

void PacketServer::advance(ClientId client) {
  Session& session = sessions_[client];
  if (session.busy || session.line.empty()) return;
  session.busy = true;
  const Asked& asked = session.line.front();
  scheduler::Request request = request_for(asked, scenario_.meshes[asked.mesh], next_key_++, client);
  transfers_.emplace(request.key, Transfer{client, asked.packet, request.size_bytes});
  turns_.enqueue(std::move(request));
}

void PacketServer::leave(ClientId client) {
  Session& session = sessions_[client];
  if (std::exchange(session.gone, true)) return;
  session.line.clear();
  session.stream->close();
  for (const Key key : turns_.session_gone(session_of(client))) transfers_.erase(key);
}

void PacketServer::pump_soon() {
  if (std::exchange(pump_is_due_, true)) return;
  timeline_.soon([this] {
    pump_is_due_ = false;
    turns_.pump();
    if (polls_ || !turns_.has_to_poll()) return;
    polls_ = true;
    poll();
  });
}

void PacketServer::poll() {
  const turns::Time next = turns_.poll();
  polls_ = turns_.has_to_poll();
  if (polls_) poll_at(std::chrono::duration<double>(next).count());
}

void PacketServer::poll_by(turns::Time when) {
  if (polls_) poll_at(std::chrono::duration<double>(when).count());
}

void PacketServer::poll_at(double when) {
  timeline_.at(timeline_.waking(when), [this, number = ++poll_] {
    if (polls_ && number == poll_) poll();
  });
}

std::shared_ptr<turns::Stream> PacketServer::stream_of(Key key) {
  return sessions_[transfers_.at(key).client].stream;
}

std::optional<turns::Content> PacketServer::fetch(Key key) {
  return turns::Content{transfers_.at(key).bytes};
}

void PacketServer::send(Key key, std::uint64_t /*offset*/, std::size_t size) {
  sessions_[transfers_.at(key).client].stream->queue(kChunkHead + size);
  ++totals_.chunks;
  totals_.payload_bytes += size;
  if (!totals_.first_at) totals_.first_at = timeline_.now();
}

void PacketServer::end(Key key, bool /*is_cancelled*/) {
  const Transfer transfer = transfers_.at(key);
  Session& session = sessions_[transfer.client];
  const std::uint64_t last_byte = session.stream->queued_position();
  session.stream->queue(kTransferEndFrame);
  if (on_packet) on_packet(transfer.client, transfer.packet, last_byte, session.stream->queued_position());
  session.line.pop_front();
  session.busy = false;
  advance(transfer.client);
}

void PacketServer::drop(scheduler::SessionKey session, turns::Pace::Verdict /*verdict*/) {
  const ClientId client = client_of(session);
  leave(client);
  connections_[client]->reset();
  ++totals_.dropped;
  if (on_drop) on_drop(client);
}

}  // namespace pmcd::sim
