// SPDX-License-Identifier: MIT
// What is simulated: lines, clients, when they come and what they fetch. Plain values, made from a seed or after the
// paper's experiments; nothing runs here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/meshes.h"
#include "sim/problem.h"

namespace pmcd::sim {

/// A kind of connection that clients have.
struct Line {
  std::string name;
  double down_kbit = 0;
  double up_kbit = 0;
  double round_trip = 0;   ///< seconds, without any queue
  double weight = 1;       ///< how often it is drawn, beside the others
  double queue_bytes = 0;  ///< that wait before it at most, each way; 0: as Tcp says
};

/// What carries a line's bytes, apart from speed and distance.
struct Tcp {
  double initial_window = 10 * 1448;  ///< bytes
  /// What stands in front of a bottleneck before it drops: so many seconds of its speed, but so many bytes at least.
  double queue_seconds = 0.1;
  double queue_bytes = 10 * 1500;
  /// A socket takes bytes while it holds fewer than 100 ms of the client's speed, or a chunk, that have not left.
  /// False: while it holds none, so that a chunk is all that is under way when another's turn comes.
  bool sockets_buffer = true;
};

struct ClientPlan {
  double arrives = 0;  ///< seconds, when it connects
  std::uint32_t line = 0;
  std::vector<std::uint32_t> meshes;  ///< fetched one after the other
  bool stalls = false;                ///< takes nothing any more when half of its first mesh has come
  /// Packets of its first mesh behind which it takes nothing any more, or leaves.
  std::optional<std::uint32_t> stalls_after = std::nullopt;
  std::optional<std::uint32_t> leaves_after = std::nullopt;
  /// How long it takes to connect and join, where that is known; else it is simulated.
  std::optional<double> joins_after = std::nullopt;
};

/// What carries the bytes from the daemon to the clients.
enum class Network : std::uint8_t {
  fluid,    ///< shares of the uplink, for very large crowds
  packets,  ///< each segment by itself, as the kernel sends it
};

struct Scenario {
  std::vector<Line> lines;
  std::vector<Mesh> meshes;
  std::vector<ClientPlan> clients;
  double uplink_kbit = 256;
  unsigned open = 4;               ///< requests that a client keeps open
  double setup_round_trips = 4.5;  ///< from connecting to the first request at the server; fluid only
  double decode_rate = 0;          ///< bytes of packets a second; 0: no time at all
  Network network = Network::fluid;
  double uplink_queue_bytes = 0;  ///< 0: as Tcp says
  double lateness = 0;            ///< of packets only: seconds that each process wakes up late on average
  std::uint64_t seed = 1;         ///< what that is drawn from
  Tcp tcp;
  /// How often the daemon looks at what a client has acknowledged, seconds; 0: at each chunk only.
  double look_every = 0.02;
  /// So many seconds of a client's speed are a chunk. 0.1 is the daemon's; with more there are fewer of them to
  /// simulate.
  double chunk_seconds = 0.1;
};

/// The paper's kinds: 33.6, 1024/256 and 2048/384 kbit/s.
std::vector<Line> paper_lines();

/// "NAME=DOWN/UP/RTT_MS[:WEIGHT]", kbit/s and milliseconds.
Result<Line> parse_line(std::string_view text);

enum class Arrivals : std::uint8_t { at_once, every, poisson };
struct ArrivalProcess {
  Arrivals kind = Arrivals::at_once;
  double value = 0;  ///< every: seconds; poisson: clients a second
};
/// "at-once", "every:S" or "poisson:RATE".
Result<ArrivalProcess> parse_arrivals(std::string_view text);

struct Crowd {
  std::size_t clients = 0;
  ArrivalProcess arrivals;
  std::size_t meshes_each = 1;  ///< drawn from all meshes, each at most once if there are enough
  double stall_share = 0;
  std::uint64_t seed = 1;
};
/// Clients as `crowd` says for the scenario's lines and meshes. REQUIRES: there is one of each.
std::vector<ClientPlan> draw_clients(const Scenario& scenario, const Crowd& crowd);

/// Experiment 1 to 4 of the paper with the scenario's lines (the paper's) and meshes: 1, three speeds and the same
/// mesh; 2, three speeds and three meshes; 3, three meshes at the same speed; 4, twenty clients that arrive at random,
/// one of which stalls. Meshes are taken from the beginning, again and again if there are too few. `scale`: what all
/// speeds were multiplied by, so that the twenty come so much faster.
std::vector<ClientPlan> paper_clients(const Scenario& scenario, int experiment, std::uint64_t seed, double scale);

/// Bytes that may wait before a link of that speed.
double queue_of(const Tcp& tcp, double kbit);

/// Multiplies all speeds; distances stay.
void scale_speeds(Scenario& scenario, double factor);

}  // namespace pmcd::sim
