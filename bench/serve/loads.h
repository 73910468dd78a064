// SPDX-License-Identifier: MIT
// The three loads that serve_load puts on a daemon; each returns its figures as JSON. All run on one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace pmcd::bench {

struct FetchOptions {
  std::uint16_t port = 0;           ///< of the request channel, on 127.0.0.1
  std::vector<std::string> meshes;  ///< session k fetches mesh k modulo their number
  std::uint64_t packet_bytes = 0;   ///< of every packet
  std::size_t sessions = 64;
  std::size_t open = 1;  ///< requests that each session keeps open
  double seconds = 5;
};

/// Sessions that always have requests open: get_base_mesh, get_next_packet until end_of_mesh, and again. Counted are
/// requests that ended by `complete`, and their packet bytes. Order and length of every packet are checked, and of one
/// in 64 the checksums, its own and the directory's.
nlohmann::json fetch_load(const FetchOptions& options);

struct SetupOptions {
  std::uint16_t port = 0;
  std::size_t at_once = 64;
  double seconds = 5;
};

/// Sessions that come and go: connect, hello, connect, join, join_ok, goodbye, both channels closed by the daemon.
nlohmann::json setup_load(const SetupOptions& options);

struct HoldOptions {
  std::uint16_t port = 0;
  std::size_t sessions = 0;
  std::size_t opened = 0;  ///< so many of them open `mesh`
  std::string mesh;
};

/// Sessions that stand and do nothing, in three steps with a line of JSON printed after each, and a line of input
/// awaited in between: they are opened; some open a mesh; some are pinged, and one session more is tried.
void hold_load(const HoldOptions& options);

}  // namespace pmcd::bench
