// SPDX-License-Identifier: MIT
// What the tests of MeshFetch share: a fetch that writes down what it is told, and the mesh that it fetches.
#pragma once

#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "client/fetch.h"
#include "tests/client/mock_server.h"

namespace pmcd::client::testing {

/// A fetch of mesh "m" that writes down what it is told.
struct Recorded {
  FetchOptions options;
  FetchCallbacks callbacks;
  FetchState state;
  std::vector<proto::Bytes> levels;
  std::vector<RetryNotice> retries;
  std::vector<proto::Bytes> directories;
  int restarts = 0;
  std::uint64_t told = 0;

  Recorded() {
    options.session = quick();
    options.retry.first_pause = std::chrono::milliseconds(2);
    options.retry.jitter = 0;
    options.retry.most_tries = 3;
    callbacks.on_level = [this](const FetchedLevel& level) {
      levels.emplace_back(level.packet.begin(), level.packet.end());
      return true;
    };
    callbacks.on_progress = [this](const Progress& progress) {
      told += progress.bytes.size();
      return true;
    };
    callbacks.on_directory = [this](const codec::Directory&, proto::ByteView bytes) {
      directories.emplace_back(bytes.begin(), bytes.end());
    };
    callbacks.on_retry = [this](const RetryNotice& retry) { retries.push_back(retry); };
    callbacks.on_restart = [this] {
      ++restarts;
      levels.clear();
    };
  }

  Result<FetchSummary> run(const MockServer& server) { return run(server.address()); }
  Result<FetchSummary> run(const Address& address) {
    MeshFetch fetch(address, "m", options, callbacks, std::move(state));
    auto result = fetch.run();
    state = fetch.state();
    return result;
  }
};

inline std::uint64_t size_of(const std::vector<proto::Bytes>& packets) {
  return std::accumulate(packets.begin(), packets.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const proto::Bytes& packet) { return sum + packet.size(); });
}

/// Packet 1 has 500 bytes.
inline const MockMesh kMesh = mock_mesh({10, 484, 60});

}  // namespace pmcd::client::testing
