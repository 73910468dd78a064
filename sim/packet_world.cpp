// SPDX-License-Identifier: MIT
#include "sim/packet_world.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "sim/channel.h"
#include "sim/packet_server.h"

namespace pmcd::sim {
namespace {

/// IP packets of the handshake of TCP, and the frames of the protocol in theirs.
constexpr double kSyn = 60;
constexpr double kHello = kHeadBytes + 30;
constexpr double kHelloOk = kHeadBytes + 46;
constexpr double kJoin = kHeadBytes + 28;
constexpr std::uint64_t kJoinOk = 14;
constexpr double kGetNext = kHeadBytes + 14;
constexpr double kGetBase = kHeadBytes + 11;     ///< and the mesh's name
constexpr double kMeshOpened = kHeadBytes + 60;  ///< and its levels
constexpr double kDirectoryLevel = 15;
constexpr double kGoodbye = kHeadBytes + 6;
/// What the kernel takes for a client that reads, and for one that is to stall, whose buffer is small.
constexpr double kWindow = 4e6;
constexpr double kStallingWindow = 16 * 1024;

class PacketWorld {
 public:
  PacketWorld(const Scenario& scenario, const scheduler::Policy& policy)
      : scenario_(scenario),
        timeline_(scenario.lateness, scenario.seed),
        uplink_(Shaper::of(scenario.uplink_kbit, scenario.uplink_queue_bytes > 0
                                                     ? scenario.uplink_queue_bytes
                                                     : queue_of(scenario.tcp, scenario.uplink_kbit))),
        connections_(make_connections()),
        server_(scenario, policy, timeline_, connections_),
        clients_(scenario.clients.size()) {
    std::size_t fetches = 0;
    server_.on_packet = [this](std::uint32_t client, std::uint32_t packet, std::uint64_t last_byte, std::uint64_t end) {
      clients_[client].expected.push_back({packet, last_byte, end});
    };
    server_.on_drop = [this](std::uint32_t client) { clients_[client].gone = true; };
    for (std::uint32_t i = 0; i < clients_.size(); ++i) {
      clients_[i].first_fetch = fetches;
      fetches += scenario.clients[i].meshes.size();
      connections_[i]->on_data = [this, i](std::uint64_t position) { data(i, position); };
      timeline_.at(scenario.clients[i].arrives, [this, i] { connect(i); });
    }
    fetches_.resize(fetches);
  }

  Outcome run() {
    while (timeline_.go_on()) {
    }
    return outcome();
  }

 private:
  struct Expected {
    std::uint32_t packet = 0;
    std::uint64_t last_byte = 0, end = 0;
    bool has_come = false;
  };
  struct Client {
    std::size_t first_fetch = 0;
    std::uint32_t begun = 0;
    std::uint32_t asked = 0;
    std::uint32_t ended = 0;
    double decoder_free = 0;
    double joins_at = 0;
    bool joined = false;
    bool gone = false;
    std::deque<Expected> expected;
  };

  std::vector<std::unique_ptr<Connection>> make_connections() {
    std::vector<std::unique_ptr<Connection>> connections;
    paths_.reserve(scenario_.clients.size());
    for (const ClientPlan& client : scenario_.clients) {
      const Line& line = scenario_.lines[client.line];
      const double queue = line.queue_bytes > 0 ? line.queue_bytes : queue_of(scenario_.tcp, line.down_kbit);
      paths_.push_back(std::make_unique<Path>(timeline_, uplink_, line, queue));
      const bool stalls = client.stalls || client.stalls_after;
      connections.push_back(
          std::make_unique<Connection>(timeline_, *paths_.back(), stalls ? kStallingWindow : kWindow));
    }
    return connections;
  }

  [[nodiscard]] const ClientPlan& plan(std::uint32_t client) const { return scenario_.clients[client]; }
  [[nodiscard]] std::uint32_t mesh_index(std::uint32_t client) const {
    return plan(client).meshes[clients_[client].begun - 1];
  }
  [[nodiscard]] const Mesh& mesh_of(std::uint32_t client) const { return scenario_.meshes[mesh_index(client)]; }
  Fetch& fetch_of(std::uint32_t client) { return fetches_[clients_[client].first_fetch + clients_[client].begun - 1]; }

  /// Two connections, hello and join: each waits for the one before.
  void connect(std::uint32_t client) {
    begin_fetch(client);
    Path& path = *paths_[client];
    if (const auto& known = plan(client).joins_after) {
      // The daemon's answer gets there in time, as far as it can be foreseen: a relay and the client wake up for it.
      const double joins_at = timeline_.now() + *known;
      const double answers_at = joins_at - path.round_trip() / 2 - 2 * scenario_.lateness;
      timeline_.at(answers_at, [this, client] { server_.joined(client, kJoinOk); });
      clients_[client].joins_at = joins_at;
      return;
    }
    const auto round = [&path](double up, double down, Path::Step then) {
      return [&path, up, down, then = std::move(then)] {
        path.tell_server(up, [&path, down, then] { path.tell_client(down, then); });
      };
    };
    const auto join = [this, &path, client] {
      path.tell_server(kJoin, [this, client] { server_.joined(client, kJoinOk); });
    };
    round(kSyn, kSyn, round(kHello, kHelloOk, round(kSyn, kSyn, join)))();
  }

  void begin_fetch(std::uint32_t client) {
    Client& state = clients_[client];
    const std::uint32_t mesh = plan(client).meshes[state.begun++];
    state.asked = state.ended = 0;
    Fetch& fetch = fetch_of(client);
    fetch.client = client;
    fetch.mesh = mesh;
    fetch.is_first = state.begun == 1;
    fetch.begins = timeline_.now();
  }

  /// Keeps as many requests open as wanted, for no more packets than there are.
  void ask(std::uint32_t client) {
    Client& state = clients_[client];
    const Mesh& mesh = mesh_of(client);
    while (state.asked < mesh.levels.size() && state.asked - state.ended < scenario_.open) {
      const std::uint32_t packet = state.asked++;
      const double bytes = packet == 0 ? kGetBase + static_cast<double>(mesh.name.size()) : kGetNext;
      paths_[client]->tell_server(bytes, [this, client, packet, index = mesh_index(client)] {
        if (packet == 0 && !clients_[client].gone) {
          const auto levels = static_cast<double>(scenario_.meshes[index].levels.size());
          paths_[client]->tell_client(kMeshOpened + kDirectoryLevel * levels, [] {});
        }
        // The kernel acknowledges every second one by itself.
        if (packet % 2 == 1) paths_[client]->tell_client(kHeadBytes, [] {});
        server_.request(client, index, packet);
      });
    }
  }

  void data(std::uint32_t client, std::uint64_t position) {
    Client& state = clients_[client];
    last_at_ = timeline_.now();
    if (state.gone) return;
    if (!std::exchange(state.joined, true)) {
      timeline_.at(state.joins_at, [this, client] { ask(client); });
    }
    while (!state.expected.empty() && !state.gone) {
      Expected& next = state.expected.front();
      if (!next.has_come && position >= next.last_byte) {
        next.has_come = true;
        decode(client, next.packet);
      }
      if (position < next.end) break;
      const std::uint32_t packet = next.packet;
      state.expected.pop_front();
      transfer_ended(client, packet);
    }
    if (plan(client).stalls && state.begun == 1 && 2 * position >= mesh_of(client).bytes) stall(client);
  }

  void stall(std::uint32_t client) {
    clients_[client].gone = true;
    connections_[client]->stop_reading();
  }

  void decode(std::uint32_t client, std::uint32_t packet) {
    Client& state = clients_[client];
    const auto bytes = static_cast<double>(mesh_of(client).levels[packet].bytes);
    const double work = scenario_.decode_rate > 0 ? bytes / scenario_.decode_rate : 0;
    state.decoder_free = std::max(state.decoder_free, timeline_.now()) + work;
    if (work > 0) {
      timeline_.at(state.decoder_free, [this, client, packet] { decoded(client, packet); });
    } else {
      decoded(client, packet);
    }
  }

  void decoded(std::uint32_t client, std::uint32_t packet) {
    const Mesh& mesh = mesh_of(client);
    Fetch& fetch = fetch_of(client);
    const double time = timeline_.now() - fetch.begins;
    if (packet == 0) fetch.first_level = time;
    for (std::size_t part = 0; part < kErrorParts.size(); ++part) {
      if (mesh.level_at[part] == packet) fetch.to_error[part] = time;
    }
    if (std::size_t{packet} + 1 == mesh.levels.size()) fetch.complete = time;
  }

  /// Who has one request open at a time asks when it has made something of the packet; who has several, at once.
  void transfer_ended(std::uint32_t client, std::uint32_t packet) {
    Client& state = clients_[client];
    const double ready = scenario_.open > 1 ? timeline_.now() : std::max(timeline_.now(), state.decoder_free);
    const bool is_last = std::size_t{packet} + 1 == mesh_of(client).levels.size();
    const auto go_on = [this, client, packet, is_last] {
      Client& now = clients_[client];
      if (now.gone) return;
      ++now.ended;
      const bool is_first = now.begun == 1;
      const bool leaves = is_first && plan(client).leaves_after == packet;
      if (leaves || (is_last && now.begun == plan(client).meshes.size())) {
        leave(client);
        return;
      }
      if (is_last) begin_fetch(client);
      ask(client);
      if (is_first && plan(client).stalls_after == packet) stall(client);
    };
    const double at = is_last ? std::max(ready, state.decoder_free) : ready;
    if (at <= timeline_.now()) {
      go_on();
    } else {
      timeline_.at(at, go_on);
    }
  }

  void leave(std::uint32_t client) {
    clients_[client].gone = true;
    paths_[client]->tell_server(kGoodbye, [this, client] {
      server_.leave(client);
      connections_[client]->reset();
    });
  }

  Outcome outcome() {
    Outcome outcome;
    for (std::size_t i = 0; i < clients_.size(); ++i) {
      const auto first = fetches_.begin() + static_cast<std::ptrdiff_t>(clients_[i].first_fetch);
      outcome.fetches.insert(outcome.fetches.end(), first, first + clients_[i].begun);
    }
    const PacketServer::Totals& totals = server_.totals();
    double stream = 0;
    for (const auto& connection : connections_) stream += static_cast<double>(connection->acknowledged());
    const double busy = last_at_ - totals.first_at.value_or(0);
    const double capacity = goodput(scenario_.uplink_kbit);
    outcome.link_use = busy > 0 ? stream / (busy * capacity) : 0;
    outcome.seconds = last_at_ - (scenario_.clients.empty() ? 0 : scenario_.clients.front().arrives);
    outcome.payload_bytes = totals.payload_bytes;
    outcome.chunks = totals.chunks;
    outcome.events = timeline_.count();
    outcome.dropped = totals.dropped;
    return outcome;
  }

  const Scenario& scenario_;
  Timeline timeline_;
  Shaper uplink_;
  std::vector<std::unique_ptr<Path>> paths_;
  std::vector<std::unique_ptr<Connection>> connections_;
  PacketServer server_;
  std::vector<Client> clients_;
  std::vector<Fetch> fetches_;
  double last_at_ = 0;
};

}  // namespace

Outcome simulate_packets(const Scenario& scenario, const scheduler::Policy& policy) {
  return PacketWorld(scenario, policy).run();
}

}  // namespace pmcd::sim
