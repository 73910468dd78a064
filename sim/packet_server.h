// SPDX-License-Identifier: MIT
// The daemon over the network of packets: the scheduler's own code, driven step by step as the daemon's dispatcher and
// channels do it, with the times at which they look at their sockets. It makes no decision of a rule, and knows nothing
// of what clients do with their packets.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "daemon/scheduler/scheduler.h"
#include "sim/asked.h"
#include "sim/connection.h"
#include "sim/scenario.h"
#include "sim/timeline.h"

namespace pmcd::sim {

class PacketServer {
 public:
  using ClientId = std::uint32_t;

  /// REQUIRES: all outlive it; `connections` are those of the scenario's clients.
  PacketServer(const Scenario& scenario, const scheduler::Policy& policy, Timeline& timeline,
               std::vector<std::unique_ptr<Connection>>& connections);

  /// The data connection is joined: it begins with a frame of so many bytes.
  void joined(ClientId client, std::uint64_t bytes);
  /// A request for a packet has come.
  void request(ClientId client, std::uint32_t mesh, std::uint32_t packet);
  /// The client's session ends.
  void leave(ClientId client);

  /// Called with what a position of the client's stream means, before anything of it is sent: there a packet's last
  /// byte has come, and behind it the frame that ends its transfer.
  std::function<void(ClientId client, std::uint32_t packet, std::uint64_t last_byte, std::uint64_t end)> on_packet;
  /// The daemon drops a client that takes nothing.
  std::function<void(ClientId client)> on_drop;

  struct Totals {
    std::uint64_t payload_bytes = 0;
    std::uint64_t chunks = 0;
    std::optional<double> first_at;  ///< when the first chunk was queued
    std::uint64_t dropped = 0;
  };
  [[nodiscard]] const Totals& totals() const { return totals_; }

 private:
  using Key = scheduler::RequestKey;
  enum class Stage : std::uint8_t { sending, stopped, sent };
  struct Transfer {
    ClientId client = 0;
    std::uint32_t packet = 0;
    std::uint64_t total = 0;
    std::uint64_t next = 0;
    // Of one that has a slot.
    Stage stage = Stage::sending;
    bool begun = false;
    bool hurried = false;
    std::uint64_t end_position = 0;
  };
  struct Chunk {
    std::uint64_t end = 0;
    std::uint64_t payload = 0;
  };
  struct Session {
    bool gone = false;
    std::deque<Asked> line;  ///< of its mesh; the first is being served if `busy`
    bool busy = false;
    std::vector<Key> running;
    // Its channel.
    std::uint64_t queued = 0, written = 0;
    bool flush_is_due = false;
    std::uint64_t unsent_bound = 0;
    // What the daemon knows of its line.
    std::uint64_t acknowledged = 0;
    std::deque<Chunk> chunks;
    double info_at = -1;
    double round_trip = 0;
    double look_at = 0;
    double pause = 0;
    bool held_back = false;  ///< it waits for acknowledgements
    bool watched = false;
    // Whether it takes its data.
    double progress_at = 0;
    std::uint64_t judged = 0;
  };

  [[nodiscard]] scheduler::Time time() const;
  [[nodiscard]] std::uint64_t acknowledged_position(ClientId client);
  void advance(ClientId client);
  void pump_soon();
  void pump();
  void feed(Key key);
  bool is_held_back(ClientId client);
  bool may_go_on(Key key);
  void wait_again(Key key);
  void end_sending(Key key);
  void release(Key key);
  void queue(ClientId client, std::uint64_t bytes);
  void flush(ClientId client);
  void progress(ClientId client);
  [[nodiscard]] std::uint64_t chunk_bytes(ClientId client);
  void look(ClientId client);
  void settle(ClientId client);
  void look_by(ClientId client, double when);
  void hurry();
  void watch();
  void watch_at(double when);
  void judge();

  const Scenario& scenario_;
  Timeline& timeline_;
  std::vector<std::unique_ptr<Connection>>& connections_;
  scheduler::Scheduler scheduler_;
  std::vector<Session> sessions_;
  std::unordered_map<Key, Transfer> waiting_, running_;
  std::set<ClientId> watched_;
  Key next_key_ = 1;
  bool pump_is_due_ = false;
  bool watching_ = false;
  double wakes_at_ = 0, judge_at_ = 0, uplink_at_ = 0;
  std::uint64_t watch_ = 0;  ///< the last time that the watch was set
  Totals totals_;
};

}  // namespace pmcd::sim
