// SPDX-License-Identifier: MIT
// The daemon's side of the simulation: it drives the scheduler's own code as the daemon's turns do, chunk by chunk,
// from the request to the acknowledgement of the last byte. It makes no decision of a rule, and knows nothing of what
// clients do with their packets.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/scheduler/scheduler.h"
#include "daemon/turns/line.h"
#include "sim/asked.h"
#include "sim/channel.h"
#include "sim/events.h"
#include "sim/links.h"
#include "sim/scenario.h"

namespace pmcd::sim {

class Driver {
 public:
  using ClientId = std::uint32_t;

  /// REQUIRES: all outlive it.
  Driver(const Scenario& scenario, scheduler::Policy policy, Uplink& uplink, Events& events);

  /// A client's request for a packet has come.
  void request(ClientId client, std::uint32_t mesh, std::uint32_t packet, double now);
  /// The client's flow is at its target.
  void progress(ClientId client, double now);
  /// Events of these kinds.
  void acknowledged(ClientId client, double now);
  void look(ClientId client, double now);
  void round_over(ClientId client, double now);
  void turn_check(ClientId client, double now);
  void stall_check(ClientId client, double now);
  /// The client's session ends, if it has not been dropped before.
  void leave(ClientId client, double now);

  /// Gives free slots to those who wait, if anything has happened that may have freed one or brought somebody.
  void pump_if_due(double now);
  /// The event of that kind.
  void foreseen_pump(double now);

  /// The client takes nothing any more once so many bytes of its stream have come through.
  void stall_at(ClientId client, double position) { sessions_[client].stall_at = position; }
  /// It takes nothing any more from now on.
  void stall(ClientId client, double now);
  [[nodiscard]] bool is_gone(ClientId client) const { return sessions_[client].gone; }
  [[nodiscard]] bool is_stalled(ClientId client) const { return sessions_[client].stalled; }

  struct Totals {
    double stream_bytes = 0;          ///< through the uplink, frame headers included
    std::uint64_t payload_bytes = 0;  ///< of chunks that came through
    std::uint64_t chunks = 0;
    std::optional<double> first_at;  ///< when the first chunk was queued
    double last_at = 0;              ///< when the last one was through
    std::uint64_t dropped = 0;       ///< clients that took nothing for too long
  };
  [[nodiscard]] const Totals& totals() const { return totals_; }
  [[nodiscard]] const scheduler::Scheduler& scheduler() const { return scheduler_; }

 private:
  enum class Stage : std::uint8_t { waiting, parked, sending };
  /// A transfer whose end is not queued.
  struct Transfer {
    scheduler::RequestKey key = 0;
    std::uint32_t packet = 0;
    Stage stage = Stage::waiting;
    bool turn_is_new = true;
    double turn_since = 0;
    std::uint64_t next = 0;  ///< of its bytes, to be sent
    std::uint64_t total = 0;
  };
  /// One whose end is, and whose slot is held until `end` is acknowledged or has left the socket.
  struct Sent {
    scheduler::RequestKey key = 0;
    double end = 0;
  };
  struct Acknowledgement {
    double position = 0;
    double payload = 0;
    double rate = 0;
  };
  struct Session {
    explicit Session(Channel data) : channel(std::move(data)) {}
    Channel channel;
    std::vector<Asked> line;  ///< of its mesh: those behind the one that is handed over
    std::optional<Transfer> transfer;
    std::vector<Sent> sent;
    std::vector<Acknowledgement> under_way;  ///< oldest first
    std::size_t under_way_from = 0;
    double acknowledged = 0;
    std::uint64_t acknowledged_payload = 0;
    std::optional<double> stall_at;
    double progress_at = 0;
    double round_at = -1;  ///< an event is there for it
    bool looks = false;
    bool held_back = false;  ///< waits for acknowledgements
    bool checks_turn = false;
    bool stalled = false;
    bool gone = false;
  };

  void pump(double now);
  void hand_over(Session& session, ClientId client, double now);
  void begin_turn(const scheduler::Request& request, double now);
  /// Queues chunks as the channel has room.
  void feed(Session& session, ClientId client, double now);
  /// Whether enough is under way to a client that is not measured, where others want the uplink, too.
  bool is_held_back(Session& session, ClientId client);
  /// At a chunk's end: whether the transfer goes on.
  bool may_go_on(Transfer& transfer, double now);
  void queue_chunk(Session& session, ClientId client, double now);
  /// What follows from where the stream is now, and the next moment of it.
  void settle(Session& session, ClientId client, double now);
  void schedule_look(Session& session, ClientId client, double now);
  void send_acknowledgement(Session& session, ClientId client, double position, double payload, double now);
  void observe(const Session& session, ClientId client, double rate, double now);
  void drop(Session& session, ClientId client, double now);

  [[nodiscard]] double round_trip(ClientId client) const;
  [[nodiscard]] turns::ChunkSize chunk_size(ClientId client) const;
  /// So many bytes may wait in the socket.
  [[nodiscard]] double unsent_limit(ClientId client) const;

  const Scenario& scenario_;
  Events& events_;
  turns::Limits limits_;
  scheduler::Scheduler scheduler_;
  std::vector<Session> sessions_;
  scheduler::RequestKey next_key_ = 1;
  bool pump_is_due_ = false;
  bool pump_is_foreseen_ = false;
  Totals totals_;
};

}  // namespace pmcd::sim
