// SPDX-License-Identifier: MIT
// The daemon over the network of packets: its scheduler and its turns, with modelled connections instead of sockets,
// and the times at which it does what it has put off. It decides nothing, and knows nothing of what clients do with
// their packets.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "daemon/turns/turns.h"
#include "sim/asked.h"
#include "sim/connection.h"
#include "sim/scenario.h"
#include "sim/server_stream.h"
#include "sim/timeline.h"

namespace pmcd::sim {

class PacketServer : private turns::Host {
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
  struct Transfer {
    ClientId client = 0;
    std::uint32_t packet = 0;
    std::uint64_t bytes = 0;
  };
  struct Session {
    bool gone = false;
    std::deque<Asked> line;  ///< of its mesh; the first is being served if `busy`
    bool busy = false;
    std::shared_ptr<ServerStream> stream;
  };

  [[nodiscard]] turns::Time now() const override { return scheduler_time(timeline_.now()); }
  void pump_soon() override;
  void poll_by(turns::Time when) override;
  std::shared_ptr<turns::Stream> stream_of(Key key) override;
  std::optional<turns::Content> fetch(Key key) override;
  void send(Key key, std::uint64_t offset, std::size_t size) override;
  std::size_t take_back(Key /*key*/) override { return 0; }
  void end(Key key, bool is_cancelled) override;
  void interrupted(Key /*key*/) override {}
  void released(Key key) override { transfers_.erase(key); }
  [[noreturn]] void broken(Key /*key*/, const std::exception& /*error*/) override { throw; }
  void drop(scheduler::SessionKey session, turns::Pace::Verdict verdict) override;

  /// The client's next request joins the queue: of one mesh, one at a time.
  void advance(ClientId client);
  void poll();
  void poll_at(double when);

  const Scenario& scenario_;
  Timeline& timeline_;
  std::vector<std::unique_ptr<Connection>>& connections_;
  turns::Limits limits_;
  turns::Turns turns_;
  std::vector<Session> sessions_;
  std::unordered_map<Key, Transfer> transfers_;
  Key next_key_ = 1;
  bool pump_is_due_ = false;
  bool polls_ = false;
  std::uint64_t poll_ = 0;  ///< the last time that the poll was set
  Totals totals_;
};

}  // namespace pmcd::sim
