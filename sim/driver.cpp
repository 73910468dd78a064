// SPDX-License-Identifier: MIT
// One transfer of a client at a time: the next request of its mesh is handed to the scheduler when the previous
// packet's end is queued. What the daemon asks its kernel, the driver asks the client's Channel.
#include "sim/driver.h"

#include <algorithm>
#include <utility>

namespace pmcd::sim {
namespace {

constexpr double kChunkHeader = 34;  ///< of proto/messages.h, its frame's header included
constexpr double kTransferEnd = 13;
constexpr double kPumpEvery = 0.05;
constexpr double kStall = 10;
/// How often it is looked whether a turn is over that waits for its socket, where looks are not set finer.
constexpr double kCoarseLook = 0.1;

}  // namespace

Driver::Driver(const Scenario& scenario, scheduler::Policy policy, Uplink& uplink, Events& events)
    : scenario_(scenario), events_(events), scheduler_(std::move(policy)) {
  limits_.chunk_seconds = scenario.chunk_seconds;
  sessions_.reserve(scenario.clients.size());
  for (const ClientPlan& client : scenario.clients) {
    sessions_.emplace_back(Channel(uplink, scenario.lines[client.line], scenario.tcp));
  }
}

double Driver::round_trip(ClientId client) const {
  return scenario_.lines[scenario_.clients[client].line].round_trip;
}

turns::ChunkSize Driver::chunk_size(ClientId client) const {
  const scheduler::Client* known = scheduler_.clients().find(session_of(client));
  return turns::chunk_size(known == nullptr ? std::nullopt : known->speed, limits_);
}

double Driver::unsent_limit(ClientId client) const {
  return scenario_.tcp.sockets_buffer ? static_cast<double>(chunk_size(client).unsent_bytes) : 0;
}

void Driver::request(ClientId client, std::uint32_t mesh, std::uint32_t packet, double now) {
  Session& session = sessions_[client];
  if (session.gone) return;
  session.line.push_back({mesh, packet, now});
  hand_over(session, client, now);
}

void Driver::hand_over(Session& session, ClientId client, double now) {
  if (session.transfer || session.line.empty()) return;
  const Asked asked = session.line.front();
  session.line.erase(session.line.begin());
  scheduler::Request request = request_for(asked, scenario_.meshes[asked.mesh], next_key_++, client);
  session.transfer = Transfer{request.key, asked.packet, Stage::waiting, true, now, 0, request.size_bytes};
  scheduler_.enqueue(std::move(request), scheduler_time(now));
  pump_is_due_ = true;
}

void Driver::pump_if_due(double now) {
  if (pump_is_due_) pump(now);
}

void Driver::foreseen_pump(double now) {
  pump_is_foreseen_ = false;
  pump(now);
}

void Driver::pump(double now) {
  while (scheduler_.waiting() > 0) {
    const auto request = scheduler_.take(scheduler_time(now));
    if (!request) break;
    begin_turn(*request, now);
  }
  pump_is_due_ = false;
  if (scheduler_.waiting() == 0 || !scheduler_.frees_slot_when_written() || pump_is_foreseen_) return;
  pump_is_foreseen_ = true;
  events_.add(now + kPumpEvery, What::pump);
}

void Driver::begin_turn(const scheduler::Request& request, double now) {
  const auto client = static_cast<ClientId>(request.session - 1);
  Session& session = sessions_[client];
  session.transfer->stage = Stage::sending;
  session.transfer->turn_is_new = true;
  session.transfer->turn_since = now;
  settle(session, client, now);
}

bool Driver::may_go_on(Transfer& transfer, double now) {
  if (transfer.turn_is_new || !scheduler_.quantum_is_over(transfer.key, scheduler_time(now))) return true;
  pump_is_due_ = true;
  if (scheduler_.yield(transfer.key, transfer.next, scheduler_time(now))) {
    transfer.turn_is_new = true;
    transfer.turn_since = now;
    return true;
  }
  transfer.stage = Stage::waiting;
  return false;
}

void Driver::queue_chunk(Session& session, ClientId client, double now) {
  Transfer& transfer = *session.transfer;
  if (transfer.turn_is_new) {
    scheduler_.turn_begins(transfer.key, scheduler_time(now));
    transfer.turn_is_new = false;
    transfer.turn_since = now;
  }
  const std::uint64_t size = std::min<std::uint64_t>(chunk_size(client).bytes, transfer.total - transfer.next);
  transfer.next += size;
  const bool is_last = transfer.next == transfer.total;
  const bool owed = session.acknowledged < session.channel.queued();
  session.channel.queue(kChunkHeader, static_cast<double>(size), is_last ? kTransferEnd : 0,
                        is_last ? static_cast<std::int32_t>(transfer.packet) : -1, now);
  if (!totals_.first_at) totals_.first_at = now;
  if (owed) return;
  session.progress_at = now;
  observe(session, client, 0, now);
  if (scenario_.look_every > 0) schedule_look(session, client, now);
  if (session.stalled) events_.add(now + kStall, What::stall_check, client);
}

void Driver::feed(Session& session, ClientId client, double now) {
  while (session.transfer && session.transfer->stage == Stage::sending &&
         session.channel.is_written(unsent_limit(client)) && !is_held_back(session, client)) {
    if (!may_go_on(*session.transfer, now)) return;
    queue_chunk(session, client, now);
    if (session.transfer->next < session.transfer->total) continue;
    session.sent.push_back({session.transfer->key, session.channel.queued()});
    session.transfer.reset();
    hand_over(session, client, now);
  }
}

bool Driver::is_held_back(Session& session, ClientId client) {
  const scheduler::Client* known = scheduler_.clients().find(session_of(client));
  const bool shares = scheduler_.frees_slot_when_written() && scheduler_.has_others(session_of(client));
  session.held_back = false;
  if (!shares || known == nullptr || known->speed) return false;
  const double guess = scheduler_.clients().guessed_speed(session_of(client)).value_or(0);
  const auto enough = turns::enough_under_way(guess, scheduler_time(round_trip(client)), limits_.first_chunk_bytes);
  session.held_back = session.channel.queued() - session.acknowledged >= static_cast<double>(enough);
  return session.held_back;
}

void Driver::settle(Session& session, ClientId client, double now) {
  if (session.transfer && session.transfer->stage == Stage::parked &&
      session.channel.is_written(unsent_limit(client))) {
    session.transfer->stage = Stage::waiting;
    scheduler_.unpark(session.transfer->key, scheduler_time(now));
    pump_is_due_ = true;
  }
  feed(session, client, now);
  const bool when_left = scheduler_.frees_slot_when_written();
  while (when_left && !session.sent.empty() && session.channel.has_left(session.sent.front().end)) {
    scheduler_.complete(session.sent.front().key, scheduler_time(now));
    session.sent.erase(session.sent.begin());
    pump_is_due_ = true;
  }
  const bool blocked = session.transfer && session.transfer->stage != Stage::waiting;
  if (blocked && session.transfer->stage == Stage::sending && !session.checks_turn && scheduler_.policy().quantum) {
    session.checks_turn = true;
    const double over =
        session.transfer->turn_since + std::chrono::duration<double>(*scheduler_.policy().quantum).count();
    events_.add(std::max(over, now + (scenario_.look_every > 0 ? scenario_.look_every : kCoarseLook)), What::turn_check,
                client);
  }
  const auto if_so = [](bool condition, double value) {
    return condition ? std::optional<double>(value) : std::nullopt;
  };
  session.channel.go_on(if_so(blocked, blocked ? unsent_limit(client) : 0),
                        if_so(when_left && !session.sent.empty(), session.sent.empty() ? 0 : session.sent.front().end),
                        session.stall_at, now);
  if (const auto round = session.channel.next_round(); round && *round != session.round_at) {
    session.round_at = *round;
    events_.add(*round, What::round_over, client);
  }
}

void Driver::progress(ClientId client, double now) {
  Session& session = sessions_[client];
  while (const auto piece = session.channel.take_delivered()) {
    totals_.stream_bytes += piece->end - piece->begin;
    totals_.payload_bytes += static_cast<std::uint64_t>(piece->payload);
    ++totals_.chunks;
    totals_.last_at = now;
    send_acknowledgement(session, client, piece->end, piece->payload_before + piece->payload, now);
    if (piece->ends_packet >= 0) {
      events_.add(now + round_trip(client) / 2, What::packet_comes, client,
                  static_cast<std::uint32_t>(piece->ends_packet));
    }
  }
  if (session.stall_at && session.channel.delivered() + Channel::kExact >= *session.stall_at) {
    session.stall_at.reset();
    stall(client, now);
  }
  settle(session, client, now);
}

void Driver::stall(ClientId client, double now) {
  Session& session = sessions_[client];
  if (session.gone || std::exchange(session.stalled, true)) return;
  session.channel.freeze();
  events_.add(now + round_trip(client) + kStall, What::stall_check, client);
}

void Driver::send_acknowledgement(Session& session, ClientId client, double position, double payload, double now) {
  session.under_way.push_back({position, payload, session.channel.delivery_rate()});
  events_.add(now + round_trip(client), What::acknowledged, client);
}

void Driver::observe(const Session& session, ClientId client, double rate, double now) {
  scheduler::SpeedSample sample;
  sample.now = scheduler_time(now);
  sample.acknowledged = static_cast<std::uint64_t>(session.acknowledged);
  sample.owes = session.acknowledged + Channel::kExact < session.channel.queued();
  sample.delivery_rate = rate;
  sample.round_trip = scheduler_time(round_trip(client));
  scheduler_.observe(session_of(client), sample, sample.now);
}

void Driver::acknowledged(ClientId client, double now) {
  Session& session = sessions_[client];
  if (session.gone) return;
  const Acknowledgement oldest = session.under_way[session.under_way_from++];
  if (session.under_way_from == session.under_way.size()) {
    session.under_way.clear();
    session.under_way_from = 0;
  }
  if (oldest.position > session.acknowledged) session.progress_at = now;
  session.acknowledged = std::max(session.acknowledged, oldest.position);
  observe(session, client, oldest.rate, now);
  const auto payload = static_cast<std::uint64_t>(oldest.payload);
  if (payload > session.acknowledged_payload) {
    scheduler_.acknowledged(session_of(client), payload - session.acknowledged_payload, scheduler_time(now));
    session.acknowledged_payload = payload;
  }
  if (session.held_back) settle(session, client, now);
  if (scheduler_.frees_slot_when_written()) return;
  while (!session.sent.empty() && session.sent.front().end <= session.acknowledged + Channel::kExact) {
    scheduler_.complete(session.sent.front().key, scheduler_time(now));
    session.sent.erase(session.sent.begin());
    pump_is_due_ = true;
  }
}

void Driver::schedule_look(Session& session, ClientId client, double now) {
  if (std::exchange(session.looks, true)) return;
  events_.add(now + scenario_.look_every, What::look, client);
}

void Driver::look(ClientId client, double now) {
  Session& session = sessions_[client];
  session.looks = false;
  if (session.gone || session.acknowledged + Channel::kExact >= session.channel.queued()) return;
  if (session.channel.is_busy() && !session.stalled) {
    // What is through now is what the daemon will know of a round trip later.
    send_acknowledgement(session, client, session.channel.delivered(), session.channel.delivered_payload(), now);
  } else {
    observe(session, client, 0, now);
  }
  schedule_look(session, client, now);
}

void Driver::round_over(ClientId client, double now) {
  Session& session = sessions_[client];
  if (session.gone || session.channel.next_round() != now) return;
  session.channel.round_over(now);
  settle(session, client, now);
}

void Driver::turn_check(ClientId client, double now) {
  Session& session = sessions_[client];
  session.checks_turn = false;
  if (session.gone || !session.transfer || session.transfer->stage != Stage::sending) return;
  if (!may_go_on(*session.transfer, now) && !session.channel.is_written(unsent_limit(client))) {
    scheduler_.park(session.transfer->key);
    session.transfer->stage = Stage::parked;
  }
  settle(session, client, now);
}

void Driver::stall_check(ClientId client, double now) {
  Session& session = sessions_[client];
  if (session.gone || session.acknowledged + Channel::kExact >= session.channel.queued()) return;
  if (now - session.progress_at >= kStall - 1e-9) {
    drop(session, client, now);
    ++totals_.dropped;
  } else {
    events_.add(session.progress_at + kStall, What::stall_check, client);
  }
}

void Driver::drop(Session& session, ClientId client, double now) {
  session.gone = true;
  session.channel.freeze();
  scheduler_.remove_session(session_of(client), scheduler_time(now));
  pump_is_due_ = true;
  // What a client that is gone has held is of no use: there may be very many.
  session.transfer.reset();
  std::vector<Asked>().swap(session.line);
  std::vector<Sent>().swap(session.sent);
  std::vector<Acknowledgement>().swap(session.under_way);
}

void Driver::leave(ClientId client, double now) {
  Session& session = sessions_[client];
  if (!session.gone) drop(session, client, now);
}

}  // namespace pmcd::sim
