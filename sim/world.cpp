// SPDX-License-Identifier: MIT
// The clients' side, and the loop that goes from one moment to the next: of the flows, or of the events.
#include "sim/world.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "sim/driver.h"
#include "sim/events.h"
#include "sim/links.h"
#include "sim/packet_world.h"

namespace pmcd::sim {
namespace {

/// A request with its acknowledgement, and the headers of both.
constexpr double kRequestBytes = 110;

class World {
 public:
  World(const Scenario& scenario, const scheduler::Policy& policy)
      : scenario_(scenario),
        uplink_(goodput(scenario.uplink_kbit)),
        driver_(scenario, policy, uplink_, events_),
        clients_(scenario.clients.size()),
        arrivals_(scenario.clients.size()) {
    std::size_t fetches = 0;
    for (std::uint32_t i = 0; i < clients_.size(); ++i) {
      clients_[i].first_fetch = fetches;
      fetches += scenario.clients[i].meshes.size();
    }
    fetches_.resize(fetches);
    std::iota(arrivals_.begin(), arrivals_.end(), 0U);
    std::stable_sort(arrivals_.begin(), arrivals_.end(), [&scenario](std::uint32_t a, std::uint32_t b) {
      return scenario.clients[a].arrives < scenario.clients[b].arrives;
    });
  }

  Outcome run() {
    while (true) {
      const auto reached = uplink_.next();
      const auto foreseen = next_event_at();
      if (reached && (!foreseen || reached->at <= *foreseen)) {
        now_ = std::max(now_, reached->at);
        driver_.progress(uplink_.take_next(), now_);
      } else if (foreseen) {
        const Event event = take_event();
        now_ = std::max(now_, event.at);
        uplink_.advance(now_);
        happen(event);
      } else {
        break;
      }
      driver_.pump_if_due(now_);
    }
    return outcome();
  }

 private:
  struct Client {
    std::size_t first_fetch = 0;
    std::uint32_t begun = 0;     ///< fetches
    std::uint32_t asked = 0;     ///< packets of the mesh that is being fetched
    std::uint32_t received = 0;  ///< of them
    double decoder_free = 0;
  };

  [[nodiscard]] std::optional<double> next_arrival_at() const {
    if (arrived_ == arrivals_.size()) return std::nullopt;
    return scenario_.clients[arrivals_[arrived_]].arrives;
  }
  [[nodiscard]] std::optional<double> next_event_at() const {
    const auto arrival = next_arrival_at();
    if (events_.empty()) return arrival;
    return arrival ? std::min(*arrival, events_.next_at()) : events_.next_at();
  }
  /// Who connects goes before what else happens at that moment. REQUIRES: something is foreseen.
  Event take_event() {
    const auto arrival = next_arrival_at();
    if (!arrival || (!events_.empty() && events_.next_at() < *arrival)) return events_.take();
    return {*arrival, 0, What::connects, arrivals_[arrived_++], 0};
  }

  void happen(const Event& event) {
    const std::uint32_t client = event.client;
    switch (event.what) {
      case What::connects:
        begin_fetch(client, now_ + setup(client));
        break;
      case What::request_comes:
        driver_.request(client, mesh_index(client), event.value, now_);
        break;
      case What::packet_comes:
        packet_comes(client, event.value);
        break;
      case What::packet_decoded:
        packet_decoded(client, event.value);
        break;
      case What::leaves:
        driver_.leave(client, now_);
        break;
      case What::pump:
        driver_.foreseen_pump(now_);
        break;
      case What::acknowledged:
        driver_.acknowledged(client, now_);
        break;
      case What::look:
        driver_.look(client, now_);
        break;
      case What::round_over:
        driver_.round_over(client, now_);
        break;
      case What::turn_check:
        driver_.turn_check(client, now_);
        break;
      case What::stall_check:
        driver_.stall_check(client, now_);
        break;
    }
  }

  [[nodiscard]] const Line& line_of(std::uint32_t client) const {
    return scenario_.lines[scenario_.clients[client].line];
  }
  [[nodiscard]] std::uint32_t mesh_index(std::uint32_t client) const {
    return scenario_.clients[client].meshes[clients_[client].begun - 1];
  }
  [[nodiscard]] double way_up(std::uint32_t client) const {
    const Line& line = line_of(client);
    return line.round_trip / 2 + kRequestBytes / (line.up_kbit * 125);
  }
  /// From connecting until the first request has come.
  [[nodiscard]] double setup(std::uint32_t client) const {
    const auto& known = scenario_.clients[client].joins_after;
    return known ? *known + way_up(client) : scenario_.setup_round_trips * line_of(client).round_trip;
  }
  Fetch& fetch_of(std::uint32_t client) { return fetches_[clients_[client].first_fetch + clients_[client].begun - 1]; }

  /// `first_comes`: when its first request is with the daemon.
  void begin_fetch(std::uint32_t client, double first_comes) {
    Client& state = clients_[client];
    const ClientPlan& plan = scenario_.clients[client];
    const std::uint32_t mesh = plan.meshes[state.begun++];
    state.asked = state.received = 0;
    Fetch& fetch = fetch_of(client);
    fetch.client = client;
    fetch.mesh = mesh;
    fetch.is_first = state.begun == 1;
    fetch.begins = now_;
    if (plan.stalls && state.begun == 1) {
      driver_.stall_at(client, static_cast<double>(scenario_.meshes[mesh].bytes) / 2);
    }
    while (ask(client, first_comes)) {
    }
  }

  /// One more request, if the client may and there is something to ask for.
  bool ask(std::uint32_t client, double comes) {
    Client& state = clients_[client];
    const std::size_t packets = scenario_.meshes[mesh_index(client)].levels.size();
    if (state.asked == packets || state.asked - state.received >= scenario_.open) return false;
    events_.add(comes, What::request_comes, client, state.asked++);
    return true;
  }

  void packet_comes(std::uint32_t client, std::uint32_t packet) {
    if (driver_.is_gone(client)) return;
    Client& state = clients_[client];
    const std::uint64_t bytes = scenario_.meshes[mesh_index(client)].levels[packet].bytes;
    const double work = scenario_.decode_rate > 0 ? static_cast<double>(bytes) / scenario_.decode_rate : 0;
    state.decoder_free = std::max(state.decoder_free, now_) + work;
    ++state.received;
    // Who has one request open at a time asks when it has made something of the packet; who has several, at once.
    if (scenario_.open > 1) ask(client, now_ + way_up(client));
    if (work > 0) {
      events_.add(state.decoder_free, What::packet_decoded, client, packet);
    } else {
      packet_decoded(client, packet);
    }
  }

  void packet_decoded(std::uint32_t client, std::uint32_t packet) {
    if (driver_.is_gone(client)) return;
    if (scenario_.open == 1) ask(client, now_ + way_up(client));
    const ClientPlan& plan = scenario_.clients[client];
    if (clients_[client].begun == 1 && plan.stalls_after == packet) driver_.stall(client, now_);
    if (clients_[client].begun == 1 && plan.leaves_after == packet) {
      events_.add(now_ + way_up(client), What::leaves, client);
    }
    const Mesh& mesh = scenario_.meshes[mesh_index(client)];
    Fetch& fetch = fetch_of(client);
    const double time = now_ - fetch.begins;
    if (packet == 0) fetch.first_level = time;
    for (std::size_t part = 0; part < kErrorParts.size(); ++part) {
      if (mesh.level_at[part] == packet) fetch.to_error[part] = time;
    }
    if (std::size_t{packet} + 1 < mesh.levels.size()) return;
    fetch.complete = time;
    if (clients_[client].begun < scenario_.clients[client].meshes.size()) {
      begin_fetch(client, now_ + way_up(client));
    } else {
      events_.add(now_ + way_up(client), What::leaves, client);
    }
  }

  Outcome outcome() {
    Outcome outcome;
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      const auto first = fetches_.begin() + static_cast<std::ptrdiff_t>(clients_[i].first_fetch);
      outcome.fetches.insert(outcome.fetches.end(), first, first + clients_[i].begun);
    }
    const Driver::Totals& totals = driver_.totals();
    const double busy = totals.last_at - totals.first_at.value_or(0);
    outcome.link_use = busy > 0 ? totals.stream_bytes / (busy * uplink_.capacity()) : 0;
    outcome.seconds = totals.last_at - (scenario_.clients.empty() ? 0 : scenario_.clients.front().arrives);
    outcome.payload_bytes = totals.payload_bytes;
    outcome.chunks = totals.chunks;
    outcome.events = events_.count() + clients_.size();
    outcome.dropped = totals.dropped;
    return outcome;
  }

  const Scenario& scenario_;
  Events events_;
  Uplink uplink_;
  Driver driver_;
  std::vector<Client> clients_;
  std::vector<std::uint32_t> arrivals_;  ///< clients in the order in which they connect; apart, so that events are few
  std::size_t arrived_ = 0;              ///< of them
  std::vector<Fetch> fetches_;
  double now_ = 0;
};

}  // namespace

Outcome simulate(const Scenario& scenario, const scheduler::Policy& policy) {
  if (scenario.network == Network::packets) return simulate_packets(scenario, policy);
  return World(scenario, policy).run();
}

double best_time(const Scenario& scenario, const Fetch& fetch) {
  const Line& line = scenario.lines[scenario.clients[fetch.client].line];
  const double rate = goodput(std::min(scenario.uplink_kbit, line.down_kbit));
  const double round_trips = fetch.is_first ? scenario.setup_round_trips + 0.5 : 1.0;
  return round_trips * line.round_trip + static_cast<double>(scenario.meshes[fetch.mesh].bytes) / rate;
}

}  // namespace pmcd::sim
